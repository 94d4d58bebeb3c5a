"""Pages of studies in a browser: points show their runs, limits sift them, and the keyboard reaches everything."""

import pandas as pd
import pytest
from railcosim.orchestrator.report import write_report

pytestmark = pytest.mark.long
PLACE = """() => {
  const plot = Bokeh.documents[0].roots()[0], views = Object.values(Bokeh.index.roots ?? Bokeh.index);
  const frame = views.find((one) => one.model === plot).frame;
  const drawn = plot.renderers.map((one) => one.data_source.data).find((data) => data.x.length);
  const box = document.querySelector("#map .plot").getBoundingClientRect();
  return [box.left + frame.x_scale.compute(drawn.x[0]), box.top + frame.y_scale.compute(drawn.y[0])];
}"""
"""Where on the screen the first point of the map is."""


@pytest.fixture
def page(opened, study):
    return opened(write_report([study(runs=40)]))


def shown(page):
    return page.locator("#run h3").first.text_content()


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 400)])
def test_a_study(opened, study, looked_at, scheme, width):
    page = opened(write_report([study(runs=40)]), scheme, width)
    page.locator("#summary [data-number]").first.click()
    page.get_by_text("List of runs").first.click()
    looked_at(page, f"study_{scheme}_{width}")
    assert page.locator("b, i, img").count() == 0


def test_a_point_shows_its_run(page):
    """By a click, by keys, by its number, and in the list; with the command that gives it again, and its curves."""
    panel = page.locator("#map .panel").first
    panel.scroll_into_view_if_needed()
    page.wait_for_timeout(300)
    place = page.evaluate(PLACE)
    page.mouse.click(*place)
    page.wait_for_selector("#run .panel")
    first = shown(page)
    assert first.startswith("Run ")
    number = first.split()[1].rstrip(":")
    assert page.locator("#run code").text_content().endswith(f" --run {number}")
    assert page.locator("#run .panel h3").all_text_contents() == ["lag.x"]
    panel.focus()
    page.keyboard.press("ArrowRight")
    assert shown(page) != first
    page.get_by_label("number of a run").fill("7")
    page.keyboard.press("Enter")
    assert shown(page) == "Run 7: completed"


def test_limits_sift_the_runs(page):
    said = page.get_by_label("runs shown")
    assert said.text_content().startswith("40 of 40 runs")
    page.get_by_text("Axes and limits").click()
    page.get_by_label("least lag.u").fill("1.5")
    page.keyboard.press("Tab")
    kept = int(said.text_content().split()[0])
    assert 0 < kept < 40
    page.get_by_role("button", name="all runs").click()
    canvas = page.locator("#map canvas.line").first
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    page.mouse.move(box["x"] + 30, box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 30, box["y"] + 150)
    page.mouse.up()
    assert int(said.text_content().split()[0]) < 40
    page.mouse.click(box["x"] + 30, box["y"] + 200)
    assert said.text_content().startswith("40 of 40 runs")


def test_by_keyboard_alone(page):
    reached = set()
    for _ in range(60):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("() => document.activeElement.outerHTML.slice(0, 80)"))
    for wanted in ('class="skip"', "data-number", "<summary", 'class="panel"', "<select", 'type="number"'):
        assert any(wanted in each for each in reached), wanted


def test_the_list_sorts(page):
    page.get_by_text("List of runs").first.click()
    page.locator("#map th").get_by_role("button", name="end").click()
    ends = [float(text) for text in page.locator("#map td:last-child").all_text_contents()]
    assert ends == sorted(ends)


def test_a_search(opened, search, looked_at):
    best = [{"run": 1, "scenario": "best.toml", "values": [1.0, 3.0]}]
    page = opened(write_report([search(minimize=["end", "peak(lag.x)"], best=best, runs=3)]))
    page.get_by_label("number of a run").fill("2")
    page.keyboard.press("Enter")
    assert page.locator("#run .broken").first.text_content() == "it <fails>"
    looked_at(page, "search")


def test_texts_that_want_to_run(opened, search, hostile_text, is_inert):
    text = hostile_text
    frame = pd.DataFrame({"run": [0, 1], "status": [text, "completed"], "error": [text, ""], text: [text, "other"]})
    frame = frame.assign(
        **{f"metric.{text}": [1.0, 2.0], f"margin.{text}": [1.0, 2.0], f"verdict.{text}": [text, "pass"]}
    )
    directory = search(minimize=[text], best=[{"run": 0, "scenario": text, "values": [1.0]}], vary=[text], seed=text)
    frame.to_parquet(directory / "runs.parquet")
    page = opened(write_report([directory]))
    page.evaluate("() => document.querySelectorAll('details').forEach((one) => (one.open = true))")
    page.locator("#summary [data-number]").first.click()
    page.wait_for_timeout(300)
    is_inert(page)
    assert text[:16] in page.locator("#run").text_content()
