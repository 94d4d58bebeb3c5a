"""Signals over time: read, placed in a system, and kept within their rates."""

import numpy as np
import pytest
from railcosim.orchestrator import System
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.run import execute
from railcosim.orchestrator.study.search.signals import Signal, place_signals


def placed(system, *signals):
    nominal = execute(system, kind="plain")
    return place_signals(system, nominal.checked, nominal.results, [Signal.parse(text) for text in signals])


def test_a_signal_is_read_as_it_is_written():
    assert Signal.parse("target.value = signal(70, 85.5, 10)") == Signal("target.value", 70.0, 85.5, 10)
    everything = Signal.parse("line.gradients=signal(-1e-2, 1e-2, 3, linear, rate=0.5, from=1e3, to=2e3)")
    assert everything == Signal("line.gradients", -0.01, 0.01, 3, True, 0.5, 1e3, 2e3)
    assert Signal.parse("gust.size=0:2") is None
    assert Signal.parse("gust.size=normal(0, 2)") is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a.b=signal(1)", "it is no signal; write signal(low, high, pieces)"),
        ("a.b=signal(0, x, 3)", "it is no signal"),
        ("a.b=signal(0, 1, 3, cubic)", "it is no signal"),
        ("a.b=signal(0, 1, 3, linear=2)", "it is no signal"),
        ("a.b=signal(1, 0, 3)", "low < high"),
        ("a.b=signal(0, inf, 3)", "finite numbers, low < high"),
        ("a.b=signal(0, 1, 0)", "1 to 1000 pieces"),
        ("a.b=signal(0, 1, 3, rate=0)", "rate of a signal is a positive number"),
        ("a.b=signal(0, 1, 3, from=2, to=1)", "from < to"),
        ("a.b=signal(0, 1, 3, from=nan)", "from < to"),
    ],
)
def test_what_is_no_signal_is_told_with_its_form(text, said):
    with pytest.raises(ScenarioError, match="--vary") as caught:
        Signal.parse(text)
    assert said in str(caught.value)


def test_a_schedule_is_varied_where_it_stands(lagging):
    system, (one,) = placed(lagging(), "target.value=signal(0, 3, 4, linear, rate=2)")
    target = system.instances["target"]
    assert target.build == {"points": 5}
    assert target.start == {"times": [0.0, 0.5, 1.0, 1.5, 2.0], "values": [1.0] * 5, "interpolate": True}
    assert one.keys == [f"target.values[{k}]" for k in range(1, 6)]
    assert one.most == 1.0
    assert one.values(np.array([0.0, 1.0, 1.0, 1.0, 0.0])) == [0.0, 1.0, 2.0, 3.0, 2.0]
    assert one.keeps_rate([0.0, 1.0, 2.0, 3.0, 2.0])
    assert not one.keeps_rate([0.0, 1.1, 2.0, 3.0, 2.0])
    execute(system, kind="plain")


def test_what_an_input_receives_is_replaced_and_is_nominally_what_it_was(lagging):
    system = lagging()
    system.instances["target"].build["points"] = 2
    system.instances["target"].start.update(times=[0.0, 1.0], values=[1.0, 2.0])
    system.connections[0].scale, system.connections[0].offset = 2.0, 0.5
    made, (one,) = placed(system, "lag.u=signal(0, 9, 4)")
    assert one.nominal.tolist() == [2.5, 2.5, 4.5, 4.5]
    assert made.instances["lag_u"].start["values"] == [2.5, 2.5, 4.5, 4.5]
    assert [(c.source, c.target) for c in made.connections] == [("lag_u.value", "lag.u")]
    assert (execute(made, kind="plain")["lag.x"] == execute(system, kind="plain")["lag.x"]).all()


def test_an_input_that_nothing_feeds_keeps_its_start_value(mine):
    system = System(stop_time=1.0, step=0.1, order=["lag"])
    system.add("lag", mine("Lag"), u=0.25)
    system.add("lag_u", mine("Lag"))
    system.stepping.order = ["lag", "lag_u"]
    made, (one,) = placed(system, "lag.u=signal(0, 1, 2)")
    assert one.array == "lag_u_.values"
    assert one.nominal.tolist() == [0.25, 0.25]
    assert made.stepping.order == ["lag", "lag_u", "lag_u_"]


def test_what_an_output_gives_is_replaced_for_all_who_receive_it(mine, lagging):
    system = lagging(metrics={"end": "final(lag.x)"})
    system.add("more", mine("Lag"))
    system.connect("lag.x", "more.u")
    with pytest.raises(ScenarioError, match=r"'low' speaks of it.*; name the input that it reaches: more.u"):
        placed(system, "lag.x=signal(0, 1, 2)")
    system.judged.requirements = {"high": "always more.x >= 0"}
    system.judged.metrics = {}
    made, _ = placed(system, "lag.x=signal(0, 1, 2)")
    assert [(c.source, c.target) for c in made.connections] == [("target.value", "lag.u"), ("lag_x.value", "more.u")]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("lag.rate", "an input or an output"),
        ("lag.nothing", "an input or an output"),
        ("nothing.u", "name one signal of one instance"),
        ("lag.x", "nothing receives it"),
        ("row.x[1]", "connected as a part of row.x"),
        ("reader.u[2]", "connected as a part of reader.u"),
    ],
)
def test_what_cannot_be_replaced_is_told(mine, lagging, name, said):
    system = lagging()
    system.add("row", mine("Row"))
    system.add("reader", mine("Row"))
    system.connect("row.x", "reader.u")
    with pytest.raises(ScenarioError, match=r"--vary .*=signal") as caught:
        placed(system, f"{name}=signal(0, 1, 2)")
    assert said in str(caught.value)


def lines(**starts):
    system = System(stop_time=1.0, step=0.5)
    for k in (1, 2):
        one = system.add(f"line[{k}]", "Line", **starts, position=0.0)
        one.index, one.count = k, 2
    return system


def test_gradients_are_those_of_all_lines_of_a_group():
    system, (one,) = placed(lines(), "line.gradients=signal(-0.02, 0.02, 2, from=0, to=100, rate=1e-4)")
    assert one.keys == ["line.gradients[1]", "line.gradients[2]"]
    assert one.most == pytest.approx(5e-3)
    assert one.shown == ""
    for name in ("line[1]", "line[2]"):
        assert system.instances[name].build["points"] == 2
        assert system.instances[name].start == {
            "position": 0.0,
            "positions": [0.0, 50.0],
            "gradients[1]": 0.0,
            "gradients[2]": 0.0,
        }


def test_gradients_are_nominally_what_a_line_has():
    system = lines(gradients=0.01, positions=20.0)
    _, (one,) = placed(system, "line[1].gradients=signal(0, 0.02, 2, from=0, to=100)")
    assert one.nominal.tolist() == [0.01, 0.01]
    system.instances["line[2]"].start["gradients"] = 0.02
    with pytest.raises(ScenarioError, match="differ; name one: line"):
        placed(system, "line.gradients=signal(0, 0.02, 2, from=0, to=100)")
    with pytest.raises(ScenarioError, match=r"need from and to.*; write line.gradients=signal"):
        placed(system, "line.gradients=signal(0, 0.02, 2)")


def test_a_signal_that_ends_before_it_begins_is_told(lagging):
    with pytest.raises(ScenarioError, match="begins at 3 and ends at 2"):
        placed(lagging(), "lag.u=signal(0, 1, 2, from=3)")
