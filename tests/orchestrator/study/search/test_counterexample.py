"""A counterexample as a scenario and a picture."""

import pytest
from railcosim.orchestrator.errors import RailcosimError
from railcosim.orchestrator.evaluation import Verdict
from railcosim.orchestrator.run import execute
from railcosim.orchestrator.scenario import load
from railcosim.orchestrator.study.search.counterexample import (
    NOMINAL,
    changed_scenario,
    describe,
    figure_of,
    quantities,
    write_counterexample,
    write_scenario,
)
from railcosim.orchestrator.study.search.space import make_space, read_space

TEXTS = ("target.value=signal(0, 2, 4)", "lag.gain=1:4", "simulation.seed=1,2")


@pytest.fixture
def begun(lagging, tmp_path):
    """A directory with a nominal scenario, and what is varied of it."""
    nominal = execute(lagging(), kind="plain")
    system, space = make_space(lagging(), nominal.checked, nominal.results, *read_space(TEXTS))
    write_scenario(tmp_path / NOMINAL, system, ["Nominal."])
    return tmp_path, space


def test_a_scenario_stands_below_its_comments(begun):
    folder, _ = begun
    assert (folder / NOMINAL).read_text().startswith("# Nominal.\n\n[simulation]")


def test_changes_of_a_signal_become_one_list(begun):
    folder, space = begun
    system = changed_scenario(
        folder / NOMINAL, space, {"target.values[3]": 1.75, "lag.gain": 2.0, "simulation.seed": 2}
    )
    assert system.instances["target"].start["values"] == [1.0, 1.0, 1.75, 1.0]
    assert system.instances["lag"].start["gain"] == 2.0
    assert system.seed == 2


def test_a_model_is_swapped(begun, mine):
    folder, space = begun
    assert changed_scenario(folder / NOMINAL, space, {"lag": mine("Resting")}).instances["lag"].swapped


def test_a_counterexample_runs_by_itself(begun):
    folder, space = begun
    changes = {"target.values[3]": 1.75, "lag.gain": 2.0}
    path, verdict, figures = write_counterexample(folder, space, changes, "low", kind="plain")
    again = execute(load(path), kind="plain").requirements[0]
    assert again == verdict
    assert verdict.verdict == "fail"
    assert path.read_text().startswith(
        f"# Breaks requirement 'low' by {-verdict.margin:.6g} at {verdict.time:g} s: always lag.x <= 1.5\n"
    )
    assert "#     target.value: 1 of its 4 values (3)\n#     lag.gain: 2, nominal 1\n" in path.read_text()
    assert [figure.name for figure in figures] == ["counterexample-to-low.png"]
    assert write_counterexample(folder, space, changes, "low", kind="plain", figure=False)[2] == []


def test_what_does_not_break_when_it_is_run_by_itself_is_refused(begun):
    folder, space = begun
    with pytest.raises(RailcosimError, match="run by itself, it does not break low"):
        write_counterexample(folder, space, {}, "low", kind="plain")


def test_changes_are_told_a_line_each(begun):
    _, space = begun
    assert describe(space, {}) == ["nothing: it is the scenario as it stands"]
    assert describe(space, {"lag": "Other", "simulation.seed": 2}) == ["lag: Other", "simulation.seed: 2, nominal 0"]


@pytest.mark.parametrize(
    ("text", "index", "moving", "bounds"),
    [
        ("always lag.x <= 1.5 from 0.1 until lag.rate outside [1, 2]", None, ["lag.x"], ["1.5"]),
        ("always lag.x - target.value < lag.gain and target.value > 0", None, ["lag.x - target.value", "target.value"],
         ["lag.gain", "0"]),
        ("always[0,70] eventually[0,30] (abs(lag.x) >= 1)", None, ["abs(lag.x)"], ["1"]),
        ("always nothing[i - 1].x <= lag.x + i", 2, ["lag.x + 2"], []),
    ],
)  # fmt: skip
def test_what_a_requirement_compares_is_drawn(lagging, text, index, moving, bounds):
    results = execute(lagging(), kind="plain").results
    assert quantities(Verdict("it", text, "fail", index=index), results) == (moving, bounds)


def test_a_picture_shows_quantities_bounds_and_signals(begun, lagging):
    _, space = begun
    run = execute(lagging(), kind="plain")
    verdict = Verdict("low", "always lag.x <= 1.5", "fail", -0.5, 1.25)
    figure = figure_of(space, {"target.values[1]": 2.0, "lag.gain": 2.0}, verdict, run)
    assert figure["remark"] == "always lag.x <= 1.5\nlag.gain: 2, nominal 1"
    mark = [{"x": 1.25, "label": "decides"}]
    assert figure["panels"] == [
        {"title": "lag.x", "y": ["lag.x"], "bands": [["1.5"]], "marks": mark},
        {"title": "target.value, varied", "y": ["target.value"], "marks": mark},
    ]
    never = figure_of(space, {}, Verdict("low", "always lag.x < target.value", "fail"), run)
    assert never["panels"] == [{"title": text, "y": [text]} for text in ("lag.x", "target.value")]
