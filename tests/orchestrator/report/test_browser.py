"""Pages in a browser, from disk and with the network off: they draw, zoom, move and can be used by keyboard alone.

What the pages of runs do; ``studies/`` has those of studies.
"""

import pytest
from railcosim.orchestrator import System, load, run
from railcosim.orchestrator.errors import FmuError
from railcosim.orchestrator.report import write_report

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def comfort(tmp_path_factory):
    directory = tmp_path_factory.mktemp("comfort") / "run"
    run(load("comfort_cruise"), output=directory, figures=False)
    return write_report([directory])


def clock(page):
    return float(page.locator("#signals output").first.text_content().split()[0])


def seen(page):
    """Between which times the first panel over time is drawn, once it is looked at."""
    page.locator(".panel", has_text="(a) speed").scroll_into_view_if_needed()
    page.wait_for_timeout(200)
    return page.evaluate("() => { const r = Bokeh.documents[2].roots()[0].x_range; return [r.start, r.end]; }")


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 400)])
def test_a_run(opened, comfort, scheme, width, looked_at):
    page = opened(comfort, scheme, width)
    looked_at(page, f"comfort_cruise_{scheme}_{width}")
    assert page.locator(".panel").count() == 9  # one of them is of the trains


def test_zoom_and_hover(opened, comfort):
    page = opened(comfort)
    assert seen(page) == [0.0, 350.0]
    page.locator("#signals button", has_text="+").first.click()
    assert seen(page)[1] - seen(page)[0] == pytest.approx(175.0)
    page.get_by_role("button", name="the whole time").click()
    plot = page.locator("#signals .plot").nth(2)
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
    assert page.locator(".panel").count() == 10
    assert clock(page) == pytest.approx(2.2)
    panel = page.locator("#signals .panel").first
    assert panel.locator("h3").text_content() == "train[2].position, train[3].position"
    assert panel.locator(".decided").text_content() == "◆ spacing: pass, margin 995.572, decided at 2.2 s"
    gaps = page.locator(".panel", has_text="(c) distance")
    assert "spacing: pass" in gaps.locator(".decided").text_content()


def test_trains_move(opened, comfort):
    page = opened(comfort)
    play = page.get_by_role("button", name="play")
    play.click()
    page.wait_for_timeout(700)
    page.get_by_role("button", name="pause").click()
    stopped = clock(page)
    assert stopped > 2.0
    page.wait_for_timeout(100)
    assert clock(page) == stopped
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
    page.locator(".panel", has_text="(a) speed").focus()
    before = clock(page)
    page.keyboard.press("ArrowRight")
    assert clock(page) > before
    page.keyboard.press("+")
    assert seen(page)[1] - seen(page)[0] == pytest.approx(175.0)


def test_tables_sort(opened, comfort):
    page = opened(comfort)
    page.locator("th").get_by_role("button", name="margin").click()
    margins = [
        float(cell) for cell in page.locator("#verdicts table").first.locator("td:nth-child(3)").all_text_contents()
    ]
    assert margins == sorted(margins)


def test_names_that_want_to_be_markup(opened, directory):
    page = opened(write_report([directory]))
    assert page.title().startswith("A </script>")
    assert page.locator("img").count() == 0


def test_two_runs(opened, wavy, directory, tmp_path, looked_at):
    run(wavy(stop_time=10.0), kind="native", output=tmp_path / "other", figures=False)
    page = opened(write_report([directory, tmp_path / "other"]))
    assert page.locator(".legend [aria-pressed]").count() == 2 * (4 + 1 + 1)
    looked_at(page, "two_runs")
    page.locator("th").get_by_role("button", name="metric").click()


def test_a_failed_run(opened, wavy, mine, tmp_path, looked_at):
    """What failed, when and who stands on top; what was recorded until then is drawn."""
    system = wavy()
    system.add("fails", mine("Fails"), until=5.0)
    with pytest.raises(FmuError):
        run(system, kind="native", output=tmp_path, figures=False)
    page = opened(write_report([tmp_path]))
    assert page.locator("header .broken").text_content() == "failed"
    assert page.locator("#verdicts li.broken").text_content().startswith("fails, t = 5")
    looked_at(page, "failed_run")


def test_a_curve_over_another_signal(opened, directory):
    """It has an axis of its own, to zoom by buttons and keys; the pointer of time is a dot on it."""
    page = opened(write_report([directory]))
    panel = page.locator("#signals .panel", has_text="Over another")
    span = "() => { const r = Bokeh.documents.at(-1).roots()[0].x_range; return r.end - r.start; }"
    whole = page.evaluate(span)
    panel.get_by_role("button", name="zoom in").click()
    page.wait_for_timeout(200)
    assert page.evaluate(span) == pytest.approx(0.5 * whole)
    panel.focus()
    page.keyboard.press("0")
    page.wait_for_timeout(200)
    assert page.evaluate(span) == pytest.approx(whole)
    before = panel.locator("output").text_content()
    page.keyboard.press("End")
    assert panel.locator("output").text_content() != before
    assert clock(page) == 20.0


def test_signals_of_two_units_have_two_axes(opened, comfort, pictures):
    page = opened(comfort)
    page.get_by_text("Choose signals").click()
    for name in ("train[1].speed", "cruise[1].force"):
        page.get_by_label("find a signal").fill(name)
        page.get_by_role("checkbox").first.check()
    page.get_by_role("button", name="new panel of the chosen").click()
    page.wait_for_timeout(300)
    assert page.evaluate("() => Bokeh.documents.at(-1).roots()[0].right.map((axis) => axis.axis_label)") == ["[N]"]
    shown = page.locator("#signals .panel").first.locator("output").all_text_contents()
    assert [text.split()[-1] for text in shown] == ["m/s", "N"]
    page.locator("#signals .panel").first.screenshot(path=pictures / "two_units.png")


def test_ten_million_values(opened, tmp_path):
    """As hard to pack as can be: the page stays below 60 MB, and is open below 3 s on an idle machine."""
    system = System(stop_time=20_000.0, step=0.1)
    system.add("noise", "GaussianDisturbance", {"carriages": 50})
    found = run(system, output=tmp_path, figures=False)
    assert len(found) * found.results.points > 10e6
    path = write_report([tmp_path])
    assert path.stat().st_size < 60e6
    page = opened(path)
    seconds = page.evaluate("() => performance.now()") / 1000.0
    print(f"{path.stat().st_size / 1e6:.3g} MB, open after {seconds:.3g} s")
    assert seconds < 10.0  # measured: 1.8 s, on a machine with other work
