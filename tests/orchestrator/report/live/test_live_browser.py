"""Live pages in a browser, from disk and with the network off: they simulate, with the run's numbers, and follow.

Screenshots stay in ``build/pages`` to be looked at.
"""

from pathlib import Path

import numpy as np
import pytest
from railcosim.fmus.toolchain import has_zig
from railcosim.orchestrator import System, load, run
from railcosim.orchestrator.report import write_report
from railcosim.orchestrator.run import Results

axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe-playwright-python is not installed")
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not has_zig(), reason="ziglang is not installed"),
]
PICTURES = Path(__file__).parents[4] / "build" / "pages"
SAID = "#live output"


@pytest.fixture
def opened(opened):
    """Opens a page as for those that are not live, and waits until it has simulated."""

    def open_live(path, *how):
        page = opened(path, *how)
        page.wait_for_selector("html[data-live]", timeout=60_000)
        return page

    return open_live


@pytest.fixture(scope="module")
def comfort(tmp_path_factory):
    """The directory of a run of comfort_cruise, with its live page."""
    directory = tmp_path_factory.mktemp("comfort") / "run"
    run(load("comfort_cruise"), kind="native", output=directory, figures=False)
    write_report([directory], live=True)
    return directory


def numbers(page):
    """Every signal as the page has computed it last."""
    told = page.evaluate("() => [...page.live].map(([name, values]) => [name, [...values]])")
    return {name: np.array(values, dtype=float) for name, values in told}


def times_simulated(page):
    return int(page.evaluate("() => document.documentElement.dataset.live"))


def settled(page, before):
    """After it has simulated anew."""
    page.wait_for_function(f"() => Number(document.documentElement.dataset.live) > {before}")
    page.wait_for_timeout(300)
    return numbers(page)


def agree(found, results, tolerance):
    assert found.keys() == set(results.names())
    for name, values in found.items():
        own = np.asarray(results[name], dtype=float)
        np.testing.assert_allclose(values, own, rtol=tolerance, atol=tolerance, err_msg=name)


def change(page, name, value):
    """Write a number into the field of a parameter."""
    before = times_simulated(page)
    page.get_by_label("find a parameter").fill(name)
    field = page.get_by_role("spinbutton", name=f"{name}, a number")
    field.fill(str(value))
    field.press("Tab")
    return settled(page, before)


def test_its_numbers_are_the_run_s(opened, comfort):
    page = opened(comfort / "report.html")
    agree(numbers(page), Results.load(comfort), 1e-9)
    assert "350 s simulated in" in page.locator(SAID).first.text_content()


def test_changed_numbers_are_those_of_a_changed_run(opened, comfort):
    """As the program has them with that value, and back again."""
    page = opened(comfort / "report.html")
    changed = load("comfort_cruise", settings=["cruise.alpha=0.01"])
    agree(change(page, "cruise.alpha", 0.01), run(changed, kind="native").results, 1e-9)
    before = times_simulated(page)
    page.get_by_role("button", name="all as in the run").click()
    agree(settled(page, before), Results.load(comfort), 1e-9)


def test_a_slider_moves_the_curves(opened, comfort):
    """By keyboard: the first panel shows another speed of the first train, and the recorded one beside it."""
    page = opened(comfort / "report.html")
    page.locator("#signals .panel").first.scroll_into_view_if_needed()
    page.wait_for_timeout(500)
    seen = (
        "() => Bokeh.documents.map((one) => one.roots()[0]).find((one) => one.left[0].axis_label?.startsWith('speed'))"
        ".renderers.map((one) => Math.min(...one.data_source.data.y ?? []))"
    )
    before, count = page.evaluate(seen), times_simulated(page)
    reached = ""
    for _ in range(60):
        page.keyboard.press("Tab")
        reached = page.evaluate("() => document.activeElement.getAttribute('aria-label') ?? ''")
        if reached == "cruise.alpha in 1/s":
            break
    assert reached == "cruise.alpha in 1/s"
    for _ in range(30):
        page.keyboard.press("ArrowRight")
    settled(page, count)
    page.locator("#signals .panel").first.scroll_into_view_if_needed()  # what nobody sees is not drawn
    page.wait_for_timeout(500)
    after = page.evaluate(seen)
    assert after[0] != pytest.approx(before[0], abs=0.1)
    assert any(one == pytest.approx(before[0]) for one in after[1:]), "what was recorded stays"
    page.screenshot(path=PICTURES / "live_moved.png")


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 400)])
def test_it_can_be_read_by_all(opened, comfort, scheme, width):
    page = opened(comfort / "report.html", scheme, width)
    PICTURES.mkdir(parents=True, exist_ok=True)
    page.locator("#signals .panel").first.scroll_into_view_if_needed()
    page.wait_for_timeout(300)
    page.screenshot(path=PICTURES / f"live_{scheme}_{width}.png")
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth"), "it is wider than the screen"
    found = axe.Axe().run(page).response["violations"]
    assert not [each["id"] for each in found if each["impact"] in ("serious", "critical")], found


def test_a_model_that_fails_says_so(opened, mine, tmp_path):
    """Up to there it is drawn; the next run goes well again."""
    system = System(stop_time=10.0, step=0.1)
    system.add("it", mine("Fails"), until=100.0)
    run(system, kind="native", output=tmp_path / "run", figures=False)
    page = opened(write_report([tmp_path / "run"], live=True, trust=True))
    found = change(page, "it.until", 5.0)
    assert page.locator(SAID).first.text_content().startswith("it, t = ")
    assert np.isfinite(found["it.x"][:40]).all()
    assert np.isnan(found["it.x"][-1])
    assert np.isfinite(change(page, "it.until", 50.0)["it.x"]).all()
    assert "10 s simulated in" in page.locator(SAID).first.text_content()


@pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])
def test_every_kind_of_connection(opened, mine, tmp_path, algorithm):
    """Delays, scales, offsets, thresholds, truth values, whole numbers, steps of their own, rows that are left out."""
    system = System(stop_time=4.05, step=0.05, record=0.2, algorithm=algorithm)
    system.add("wave", mine("Wave"))
    system.add("slow", mine("Lag"), x=0.3).step = 0.15
    system.add("level", mine("Level"), level=0.4)
    system.add("not", mine("Not"))
    system.add("switch", mine("Switch"), on=True)
    system.add("whole", mine("Whole"))
    system.add("count", mine("Count"), sample_time=0.1)
    system.add("heater", mine("Heater"))
    system.connect("wave.y", "slow.u", delay=3, scale=2.0, offset=0.25)
    system.connect("slow.x", "level.u")
    system.connect("level.on", "not.u", delay=1)
    system.connect("not.y", "switch.on")
    system.connect("slow.x", "switch.w", scale=-3.0)
    system.connect("count.n", "whole.n", scale=0.7, threshold=0.5)
    system.connect("wave.y", "heater.on", threshold=0.1)
    outcome = run(system, kind="native", output=tmp_path / "run", figures=False)
    page = opened(write_report([tmp_path / "run"], live=True, trust=True))
    agree(numbers(page), outcome.results, 1e-12)


@pytest.mark.parametrize(
    ("scenario", "stop"), [("tunable_potential", 200.0), ("cailc", 210.0), ("fault_tolerant_cruise", 50.0)]
)
def test_the_other_papers(opened, tmp_path, scenario, stop):
    system = load(scenario).changed(stop_time=stop)
    outcome = run(system, kind="native", output=tmp_path / "run", figures=False)
    page = opened(write_report([tmp_path / "run"], live=True))
    agree(numbers(page), outcome.results, 1e-9)
