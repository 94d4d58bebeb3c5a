"""The site: built strictly, with formulas made beforehand, and nothing that is loaded from elsewhere."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from railcosim.components import CATALOGUE
from railcosim.orchestrator.cli.app import app
from typer.main import get_command

pytestmark = pytest.mark.long
ROOT = Path(__file__).parents[2]
ELSEWHERE = re.compile(r'(?:src|srcset)="(?:https?:)?//|<link [^>]*href="(?:https?:)?//|url\((?:https?:)?//|@import')


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    pytest.importorskip("material", reason="the extra 'docs' is not installed")
    target = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(target)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return target


def test_each_component_has_a_page_with_mathml_and_figure(site, component_page):
    for name, cls in CATALOGUE.items():
        page = (site / "components" / f"{name}.html").read_text(encoding="utf-8")
        assert page.count("<math ") == sum(text.count("$") for text in cls.equations) // 2
        assert "arithmatex" not in page
        figure = page[page.index('<figure class="signals"') : page.index("</figure>")]
        assert figure.count('id="axes_') == len(component_page.EXPERIMENTS[name]["panels"])
        assert figure.endswith(".</figcaption>")


def test_nothing_is_loaded_from_elsewhere(site):
    pages = [path for path in site.rglob("*") if path.suffix in (".html", ".css")]
    assert len(pages) > 60
    assert [path.name for path in pages if ELSEWHERE.search(path.read_text(encoding="utf-8"))] == []
    assert "iframe-worker" in (site / "index.html").read_text(encoding="utf-8")


def test_the_command_line_reference_has_every_command_and_option(site):
    page = (site / "reference" / "command_line.html").read_text(encoding="utf-8")
    for name, command in get_command(app).commands.items():
        assert f'<h2 id="{name}"' in page
        options = [option for parameter in command.params for option in parameter.opts if option.startswith("-")]
        assert all(re.search(rf"<code>[^<]*{re.escape(option)}\b", page) for option in options)


def test_the_readme_is_the_first_page_and_its_links_stay_in_the_site(site):
    page = (site / "index.html").read_text(encoding="utf-8")
    assert 'href="own_controller.html"' in page
    assert 'href="contributing.html"' in page
    assert 'src="images/comfort_cruise.png"' in page
    assert 'href="docs/' not in page


def test_python_reference_has_what_a_script_imports(site):
    page = (site / "reference" / "python.html").read_text(encoding="utf-8")
    for name in ("orchestrator.load", "orchestrator.run.run", "orchestrator.System", "components.Component"):
        assert f'id="railcosim.{name}"' in page


def test_each_paper_has_a_live_page(site):
    links = re.findall(r'href="(live/[a-z_]+\.html)"', (site / "live.html").read_text(encoding="utf-8"))
    assert len(set(links)) == 4
    for link in links:
        assert 'id="live"' in (site / link).read_text(encoding="utf-8")
