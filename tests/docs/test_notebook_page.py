"""Notebooks of the site: cells of a script, executed, with what they print and draw."""

import importlib
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "docs"
SCRIPT = """# %% [markdown]
# # A title
#
# Some *text*.

# %%
from railcosim.orchestrator import progress_bar

with progress_bar("a bar") as bar:
    bar.count(1, 2, "1 of 2")

# %%
# What is drawn
from matplotlib import pyplot

lines = pyplot.plot([1, 2])

# %%
print("printed")
import pandas

pandas.DataFrame({"<a>": [1]})

# %%
1 + 1
"""


@pytest.fixture(scope="module")
def notebook_page():
    pytest.importorskip("nbclient", reason="the extra 'docs' is not installed")
    sys.path.insert(0, str(FOLDER))
    try:
        return importlib.import_module("notebook_page")
    finally:
        sys.path.remove(str(FOLDER))


def test_a_script_in_cells_is_a_notebook(notebook_page):
    cells = notebook_page.read(SCRIPT).cells
    assert [cell.cell_type for cell in cells] == ["markdown", "code", "code", "code", "code"]
    assert cells[0].source == "# A title\n\nSome *text*."
    assert cells[4].source == "1 + 1"


def test_one_for_each_paper(notebook_page):
    assert len(notebook_page.names()) == 4
    for name in notebook_page.names():
        first = notebook_page.read((notebook_page.FOLDER / f"{name}.py").read_text(encoding="utf-8")).cells[0]
        assert first.cell_type == "markdown"
        assert f"notebooks/{name}.md" in (FOLDER.parent / "mkdocs.yml").read_text(encoding="utf-8")


@pytest.mark.long
def test_outputs_stand_below_their_cells(notebook_page, tmp_path, monkeypatch):
    (tmp_path / "small.py").write_text(SCRIPT)
    monkeypatch.setattr(notebook_page, "FOLDER", tmp_path)
    text, pictures = notebook_page.page("small")
    assert list(pictures) == ["small_1.png"]
    assert pictures["small_1.png"].startswith(b"\x89PNG")
    assert "![What is drawn](small_1.png)" in text
    assert "```text\nprinted\n```" in text
    assert "<th>&lt;a&gt;</th>" in text
    assert "```text\n2\n```" in text
    assert "Warning" not in text


@pytest.mark.long
def test_every_notebook_can_be_executed(notebook_page):
    """And shows no warning: what a library lacks in a notebook would be told in one."""
    for name in notebook_page.names():
        text, pictures = notebook_page.page(name)
        assert len(pictures) >= 2
        assert "Warning" not in text
        assert "Requirements" in text or "verdict.verdict" in text
