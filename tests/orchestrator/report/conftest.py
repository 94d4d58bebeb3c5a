"""Runs whose pages are looked at, and a browser to open them from disk with the network off.

Screenshots stay in ``build/pages`` to be looked at.
"""

import shutil
from functools import partial
from pathlib import Path

import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.report.content import Columns, read_content, signals_of, told_of
from railcosim.orchestrator.report.panels import panels

TITLE = 'A </script><img src=x onerror="document.title=1"> & $$x$$'

TEXTS = (
    '</script><script>window.hacked = 1</script><img src=x onerror="window.hacked = 2">',
    "\"'><svg onload=\"window.hacked = 3\"></title></style><a href='javascript:window.hacked=4'>x</a><!--",
    "$$x \\href{javascript:alert(1)}{y}$$ \\(x\\) \\[x\\] {{7*7}} ${window.hacked = 5} `\u2028\u2029",
)
"""What wants to be run by a page that shows it."""


def build(mine, **how):
    """Two lags behind a wave, with requirements that hold and that do not."""
    system = System(**{"stop_time": 20.0, "step": 0.1} | how)
    system.add("wave", mine("Wave"))
    system.add("lag[1]", mine("Lag"), x=0.3)
    system.add("lag[2]", mine("Lag"), x=0.9)
    system.connect("wave.y", "lag[1].u")
    system.connect("lag[1].x", "lag[2].u")
    system.provenance.title = TITLE
    system.judged.metrics = {"peak": "peak(lag[i].x)", "end": "final(wave.y)"}
    system.judged.requirements = {"low": "always lag[i].x < 0.95", "lower": "always lag[i].x < 0.5"}
    twice = {"title": "twice, up to {max(lag[1].x)}", "y": ["lag[1].x"], "scale": 2.0, "y_label": "2 x"}
    system.judged.figures = [
        {"title": "Both </script>", "y": ["lag[:].x", "wave.y", "lag[1].x - wave.y"]},
        {"title": "Scaled", "panels": [twice]},
        {"title": "Over another", "x": "lag[1].x", "y": ["lag[2].x"]},
    ]
    return system


@pytest.fixture
def wavy(mine):
    """Makes such a system."""
    return partial(build, mine)


@pytest.fixture
def title():
    """Of such a system: one that wants to be markup, or mathematics."""
    return TITLE


@pytest.fixture
def directory(wavy, tmp_path):
    """Of a run that has ended."""
    run(wavy(), kind="native", output=tmp_path / "run", figures=False)
    return tmp_path / "run"


def tell(*directories):
    """What the script of a page is given of runs, and the runs."""
    columns = Columns()
    contents = [read_content(directory, columns) for directory in directories]
    names = [str(k) for k in range(len(contents))]
    data = {
        "runs": [told_of(content, name, columns) for content, name in zip(contents, names, strict=True)],
        "signals": signals_of(contents),
        "panels": panels(contents, names, columns),
        "columns": columns.told,
    }
    return data, contents


@pytest.fixture
def told():
    """Tells what a page is given of runs."""
    return tell


@pytest.fixture(scope="module")
def browser():
    """A Chromium, where there is one."""
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    found = shutil.which("chromium")
    if found is None:
        pytest.skip("there is no chromium")
    with api.sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=found, args=["--no-sandbox", "--disable-gpu"])
        yield started
        started.close()


@pytest.fixture
def opened(browser):
    """Opens a page; whatever the browser complains of fails the test in the end."""
    complaints, contexts = [], []

    def open_page(path, scheme="light", width=1280):
        context = browser.new_context(color_scheme=scheme, viewport={"width": width, "height": 900}, offline=True)
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda said: complaints.append(said.text) if said.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("dialog", lambda dialog: (complaints.append(dialog.message), dialog.dismiss()))
        page.on(
            "request",
            lambda asked: complaints.append(asked.url) if not asked.url.startswith(("file:", "blob:")) else None,
        )
        page.goto(path.as_uri())
        page.wait_for_selector("html[data-ready]", timeout=30_000)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert not complaints


@pytest.fixture
def pictures():
    """The folder of screenshots."""
    folder = Path(__file__).parents[3] / "build" / "pages"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture
def looked_at(pictures):
    """Keeps a picture of a whole page, and fails for what axe-core finds of WCAG, but for what is not serious."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")

    def look(page, name):
        page.wait_for_selector("html[data-whole]", timeout=30_000)
        page.wait_for_timeout(300)
        page.screenshot(path=pictures / f"{name}.png", full_page=True)
        assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth"), "it is wider than the screen"
        found = axe.Axe().run(page).response["violations"]
        assert not [each["id"] for each in found if each["impact"] in ("serious", "critical")], found

    return look


@pytest.fixture(params=TEXTS)
def hostile_text(request):
    """A text that wants to be run by a page that shows it."""
    return request.param


@pytest.fixture
def is_inert():
    """Fails where a page has run, or made markup of, what it was to show."""

    def look(page):
        assert page.evaluate("() => window.hacked") is None
        assert page.locator("main img, main iframe, main object, a[href^='javascript'], mjx-container").count() == 0
        assert page.locator("script:not([id])").count() <= 8
        assert page.locator("svg[onload]").count() == 0

    return look
