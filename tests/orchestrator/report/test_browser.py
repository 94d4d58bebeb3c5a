"""Pages in a browser, from disk and with the network off: they draw, zoom, move and can be used by keyboard alone.

Screenshots stay in ``build/pages`` to be looked at.
"""

import shutil
from pathlib import Path

import pytest
from railcosim.orchestrator import load, run
from railcosim.orchestrator.report import write_report

CHROMIUM = shutil.which("chromium")
playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")
pytestmark = [pytest.mark.long, pytest.mark.skipif(CHROMIUM is None, reason="there is no chromium")]
PICTURES = Path(__file__).parents[3] / "build" / "pages"


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
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


@pytest.fixture(scope="module")
def comfort(tmp_path_factory):
    directory = tmp_path_factory.mktemp("comfort") / "run"
    run(load("comfort_cruise"), output=directory, figures=False)
    return write_report([directory])


def clock(page):
    return float(page.locator("#signals output").first.text_content().split()[0])


def seen(page):
    """How many points the lines of the first panel have on the screen, and between which times."""
    return page.evaluate(
        "() => { const d = Bokeh.documents[0].roots()[0]; const r = d.x_range; return [r.start, r.end]; }"
    )


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 400)])
def test_a_run(opened, comfort, scheme, width):
    page = opened(comfort, scheme, width)
    PICTURES.mkdir(parents=True, exist_ok=True)
    page.wait_for_timeout(300)
    page.screenshot(path=PICTURES / f"comfort_cruise_{scheme}_{width}.png", full_page=True)
    assert page.locator(".panel").count() == 6
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth"), "it is wider than the screen"
    found = axe.Axe().run(page).response["violations"]
    assert not [each["id"] for each in found if each["impact"] in ("serious", "critical")], found


def test_zoom_and_hover(opened, comfort):
    page = opened(comfort)
    assert seen(page) == [0.0, 350.0]
    page.locator("#signals button", has_text="+").first.click()
    assert seen(page)[1] - seen(page)[0] == pytest.approx(175.0)
    page.locator("#signals button", has_text="all").click()
    plot = page.locator(".plot").first
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    assert clock(page) == pytest.approx(166.0, abs=12.0)
    page.keyboard.down("Shift")
    page.mouse.wheel(0, -400)
    page.keyboard.up("Shift")
    page.wait_for_timeout(200)
    begin, end = seen(page)
    assert end - begin == pytest.approx(280.0)
    assert begin < clock(page) < end


def test_the_instant_that_decided(opened, comfort):
    page = opened(comfort)
    page.locator("tr", has_text="spacing").get_by_role("button").click()
    page.wait_for_timeout(500)
    assert page.locator(".panel").count() == 7
    assert clock(page) == pytest.approx(2.2)
    assert page.locator(".panel h3").first.text_content() == "train[3].position"


def test_trains_move(opened, comfort):
    page = opened(comfort)
    play = page.get_by_role("button", name="play")
    play.click()
    page.wait_for_timeout(700)
    page.get_by_role("button", name="pause").click()
    assert 2.0 < clock(page) < 30.0
    said = page.locator("#trains canvas").first.get_attribute("aria-label")
    assert said.startswith("trains at ")
    assert "train[4]" in said


def test_by_keyboard_alone(opened, comfort):
    page = opened(comfort)
    reached = set()
    for _ in range(120):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("() => document.activeElement.outerHTML.slice(0, 60)"))
    for wanted in ('class="skip"', "data-requirement", "play", 'type="range"', 'class="panel"', "<summary"):
        assert any(wanted in each for each in reached), wanted
    page.locator(".panel").first.focus()
    before = clock(page)
    page.keyboard.press("ArrowRight")
    assert clock(page) > before
    page.keyboard.press("+")
    assert seen(page)[1] - seen(page)[0] == pytest.approx(175.0)


def test_tables_sort(opened, comfort):
    page = opened(comfort)
    page.get_by_role("button", name="margin").click()
    margins = [
        float(cell) for cell in page.locator("#verdicts table").first.locator("td:nth-child(3)").all_text_contents()
    ]
    assert margins == sorted(margins)


def test_names_that_want_to_be_markup(opened, directory):
    page = opened(write_report([directory]))
    assert page.title().startswith("A </script>")
    assert page.locator("img").count() == 0


def test_two_runs(opened, wavy, directory, tmp_path):
    run(wavy(stop_time=10.0), kind="native", output=tmp_path / "other", figures=False)
    page = opened(write_report([directory, tmp_path / "other"]))
    assert page.locator(".legend li").count() == 2 * 4 + 2
    page.screenshot(path=PICTURES / "two_runs.png", full_page=True)
