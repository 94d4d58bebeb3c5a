"""Notebooks of the site: kept as scripts in cells (`# %%`), executed when the site is built, shown with outputs.

A script is what is reviewed, and what a notebook editor opens as it stands (VS Code, Spyder, JupyterLab by Jupytext).
"""

from __future__ import annotations

import base64
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).parent / "notebooks"
_MARK = re.compile(r"^# %%(?: \[(\w+)\])?\n", re.MULTILINE)
_WIDGET = "application/vnd.jupyter.widget-view+json"
_SECONDS = 120
"""How long a cell may take, on a busy machine."""


class Page(NamedTuple):
    """A page as Markdown, and its pictures by name."""

    text: str
    pictures: dict[str, bytes]


def names() -> list[str]:
    """The notebooks there are."""
    return sorted(path.stem for path in FOLDER.glob("*.py"))


def read(text: str) -> Any:
    """A script in cells as a notebook without outputs."""
    parts = _MARK.split(text)
    cells = []
    for kind, content in zip(parts[1::2], parts[2::2], strict=True):
        if kind == "markdown":
            lines = [line.removeprefix("#").removeprefix(" ") for line in content.strip().splitlines()]
            cells.append(nbformat.v4.new_markdown_cell("\n".join(lines)))
        else:
            cells.append(nbformat.v4.new_code_cell(content.strip()))
    return nbformat.v4.new_notebook(cells=cells)


def executed(name: str) -> Any:
    """A notebook with its outputs; files that it writes are gone afterwards.

    Raises:
        CellExecutionError: a cell fails.
    """
    notebook = read((FOLDER / f"{name}.py").read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        where = {"metadata": {"path": folder}}
        NotebookClient(notebook, timeout=_SECONDS, kernel_name="python3", resources=where).execute()
    return notebook


def page(name: str) -> Page:
    """A notebook, executed, as a page."""
    pictures: dict[str, bytes] = {}
    parts = []
    for cell in executed(name).cells:
        if cell.cell_type == "markdown":
            parts.append(cell.source)
            continue
        parts.append(f"```python\n{cell.source}\n```")
        alt = cell.source.partition("\n")[0].removeprefix("# ")
        for output in cell.outputs:
            parts += _shown(output, alt, f"{name}_{len(pictures) + 1}.png", pictures)
    return Page("\n\n".join(parts) + "\n", pictures)


def _shown(output: Any, alt: str, picture: str, pictures: dict[str, bytes]) -> Iterator[str]:
    """What a cell has printed, drawn or returned."""
    data = output.get("data", {})
    if _WIDGET in data or (output.get("data") and not data.get("text/plain", "x").strip()):
        return  # a progress bar, which has gone
    if "image/png" in data:
        pictures[picture] = base64.b64decode(data["image/png"])
        yield f"![{alt}]({picture})"
    elif "text/html" in data:
        markup = re.sub(r"\s*\n\s*", "", data["text/html"])  # an empty line would end it
        markup = markup.replace(' class=""', "").replace(' border="1" class="dataframe"', "")
        yield f'<div class="output">{markup}</div>'
    elif text := (output.get("text") or data.get("text/plain", "")).rstrip():
        yield f"```text\n{text}\n```"
