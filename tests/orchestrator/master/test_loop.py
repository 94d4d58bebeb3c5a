"""How time advances: initialization, the two algorithms, delays, and what stops a run."""

import numpy as np
import pytest
from railcosim.orchestrator.errors import FmuError, LostError, ScenarioError
from railcosim.orchestrator.master.loop import Master
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System

BOTH = pytest.mark.parametrize("kind", ["python", "plain"])
ALGORITHMS = pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])


@pytest.fixture
def system(mine):
    """A system of the components above: name -> (class, start values), and connections."""

    def make(instances, connections=(), **how):
        it = System(**{"stop_time": 5.0, "step": 1.0} | how)
        for name, (cls, start) in instances.items():
            it.add(name, mine(cls), **start)
        for source, target, *rest in connections:
            it.connect(source, target, **(rest[0] if rest else {}))
        return it

    return make


def go(it, **how):
    return run(it, **{"kind": "plain"} | how)


# -------------------------------------------------------------------- time


@ALGORITHMS
def test_a_point_in_time_is_start_plus_k_steps(system, algorithm):
    """A running sum of 0.1 s has lost 1.6e-10 s after 1e5 steps; the FMU's own clock is the same."""
    it = system({"clock": ("Clock", {})}, stop_time=1000.0 + 0.7, start_time=0.7, step=0.1, algorithm=algorithm)
    result = go(it)
    assert np.array_equal(result.time, 0.7 + np.arange(10001) * 0.1)
    assert np.abs(result["clock.t"] - result.time).max() < 1e-12
    running = np.cumsum(np.full(10000, 0.1))
    assert not np.array_equal(result.time[1:] - 0.7, running)


def test_gauss_seidel_acts_on_values_of_one_time_stamp(system):
    """In step k the force comes from the position of t_k, whoever was declared first, and is recorded a row later."""
    instances = {"plant": ("Keep", {}), "control": ("Pass", {"gain": 2.0})}
    wires = [("plant.n", "control.u"), ("control.y", "plant.u")]
    for order in (instances, dict(reversed(instances.items()))):
        result = go(system(order, wires))
        assert list(result["plant.n"]) == [10, 11, 12, 13, 14, 15]
        assert list(result["plant.seen"]) == [-1, 20, 22, 24, 26, 28]
        assert list(result["control.y"]) == [20, 20, 22, 24, 26, 28]


def test_a_source_and_what_it_is_compared_with_are_of_one_instant(system):
    """The counters are equal at every point: their difference at the controller is nought, not one step's worth."""
    instances = {"reference": ("Count", {}), "plant": ("Keep", {}), "r": ("Pass", {}), "p": ("Pass", {})}
    wires = [("reference.n", "r.u"), ("plant.n", "p.u"), ("p.y", "plant.u")]
    result = go(system(instances, wires))
    assert np.array_equal(result["r.y"], result["p.y"])


def test_jacobi_hands_a_feed_through_output_on_a_step_late(system):
    instances = {"plant": ("Keep", {}), "control": ("Pass", {"gain": 2.0})}
    wires = [("plant.n", "control.u"), ("control.y", "plant.u")]
    result = go(system(instances, wires, algorithm="jacobi"))
    assert list(result["plant.seen"]) == [-1, 20, 20, 22, 24, 26]


def test_a_chain_of_feed_through_blocks_is_passed_in_one_step(system):
    instances = {
        "c": ("Pass", {}),
        "b": ("Pass", {}),
        "a": ("Pass", {}),
        "source": ("Count", {}),
        "end": ("Keep", {}),
    }
    wires = [("source.n", "a.u"), ("a.y", "b.u"), ("b.y", "c.u"), ("c.y", "end.u")]
    assert list(go(system(instances, wires))["end.seen"]) == [-1, 10, 11, 12, 13, 14]
    late = go(system(instances, wires, algorithm="jacobi"))
    assert list(late["end.seen"]) == [-1, 10, 10, 10, 10, 11]


def test_an_order_of_the_user_s_is_obeyed(system):
    instances = {"plant": ("Keep", {}), "control": ("Pass", {})}
    wires = [("plant.n", "control.u"), ("control.y", "plant.u")]
    result = go(system(instances, wires, order=["plant", "control"]))
    assert list(result["plant.seen"]) == [-1, 10, 11, 12, 13, 14]
    assert list(result["control.y"]) == [10, 11, 12, 13, 14, 15]  # from the position of the step's end
    assert result.checked.order.sequence == ("plant", "control")
    assert len(result.checked.notes) == 2


# -------------------------------------------------------------------- delays


@pytest.mark.parametrize(
    ("delay", "order"),
    [(0, []), *((d, order) for d in (1, 2, 3) for order in ([], ["source", "end"], ["end", "source"]))],
)
def test_delay_of_an_output_without_feed_through(system, delay, order):
    """Each unit is one communication point, from the value of the step's begin, in any order; the first is the initial
    one.
    """
    wires = [("source.n", "end.u", {"delay": delay})]
    result = go(system({"source": ("Count", {}), "end": ("Keep", {})}, wires, order=order))
    assert list(result["end.seen"]) == [-1, *(max(10, 10 + k - delay) for k in range(5))]


@ALGORITHMS
@pytest.mark.parametrize("delay", [0, 1, 2, 3])
def test_delay_of_a_feed_through_output(system, algorithm, delay):
    instances = {"source": ("Count", {}), "through": ("Pass", {}), "end": ("Keep", {})}
    wires = [("source.n", "through.u"), ("through.y", "end.u", {"delay": delay})]
    result = go(system(instances, wires, algorithm=algorithm))
    lag = delay + (algorithm == "jacobi")
    assert list(result["end.seen"]) == [-1, *(max(10, 10 + k - lag) for k in range(5))]


@pytest.mark.parametrize(
    "order", [["source", "through", "end"], ["end", "source", "through"], ["through", "end", "source"]]
)
def test_a_delayed_feed_through_output_does_not_depend_on_where_its_receiver_stands(system, order):
    """The output itself does: it is computed from what its own FMU was given."""
    instances = {"source": ("Count", {}), "through": ("Pass", {}), "end": ("Keep", {})}
    wires = [("source.n", "through.u"), ("through.y", "end.u", {"delay": 1})]
    result = go(system(instances, wires, order=order))
    computed = result["through.y"]  # recorded at t_k+1: what was computed in step k
    assert list(result["end.seen"][1:]) == list(computed[:-1])


def test_a_delay_does_not_concern_the_other_connections_of_an_instance(system):
    instances = {"source": ("Count", {}), "late": ("Keep", {}), "now": ("Keep", {}), "sum": ("Pass", {})}
    wires = [("source.n", "late.u", {"delay": 2}), ("source.n", "now.u"), ("source.n", "sum.u", {"scale": 2.0})]
    result = go(system(instances, wires))
    assert list(result["late.seen"]) == [-1, 10, 10, 10, 11, 12]
    assert list(result["now.seen"]) == [-1, 10, 11, 12, 13, 14]
    assert list(result["sum.y"]) == [20, 20, 22, 24, 26, 28]


def platoon(**how):
    """Four trains of the published case."""
    it = System(**{"stop_time": 20.0, "step": 0.1} | how)
    for i, (x, v) in enumerate(zip([51e3, 34e3, 18e3, 1e3], [83.0, 61.0, 65.0, 5.0], strict=True), 1):
        it.add(f"train[{i}]", "PointMassTrain", position=x, speed=v)
        it.add(f"cruise[{i}]", "ComfortCruise", has_ahead=i > 1, has_behind=i < 4)
    it.add("target", "Schedule", values=85.0)
    it.add("gust", "Gust", start_time=5.0, stop_time=10.0)
    for i in range(1, 5):
        for name in ("position", "speed"):
            it.connect(f"train[{i}].{name}", f"cruise[{i}].{name}")
            if i > 1:
                it.connect(f"train[{i - 1}].{name}", f"cruise[{i}].ahead_{name}")
            if i < 4:
                it.connect(f"train[{i + 1}].{name}", f"cruise[{i}].behind_{name}")
        it.connect("target.value", f"cruise[{i}].target_speed")
        it.connect(f"cruise[{i}].force", f"train[{i}].force")
    it.connect("gust.acceleration", "train[1].disturbance")
    return it


def same(a, b):
    assert list(a.names()) == list(b.names())
    return all(np.array_equal(a[name], b[name]) for name in a.names())


@BOTH
def test_gauss_seidel_with_every_force_delayed_is_jacobi_bit_for_bit(kind):
    """The force of t_k-1 acts from t_k in both; the initial force is the one of the initial states."""
    delayed, jacobi = platoon(), platoon(algorithm="jacobi")
    for connection in delayed.connections:
        connection.delay = int(connection.source.endswith("force"))
    a, b, plain = go(delayed, kind=kind), go(jacobi, kind=kind), go(platoon(), kind=kind)
    assert same(a, b)
    assert not same(a, plain)


def test_in_process_and_as_fmus_the_bits_are_the_same(system):
    assert same(go(platoon(), kind="python"), go(platoon(), kind="plain"))


# -------------------------------------------------------------------- initialization


@BOTH
def test_time_zero_is_consistent(kind):
    result = go(platoon(stop_time=0.1), kind=kind)
    first = {name: result[name][0] for name in result.names()}
    for i, demand in enumerate([-0.595, 0.937, -0.907, 0.9999], 1):  # docs/models/comfort_cruise.md, section 3
        assert first[f"cruise[{i}].demand"] == pytest.approx(demand, abs=0.002)
        assert first[f"train[{i}].acceleration"] == pytest.approx(first[f"cruise[{i}].demand"], abs=1e-12)
        assert first[f"train[{i}].applied_force"] == first[f"cruise[{i}].force"]


@ALGORITHMS
@pytest.mark.parametrize("backwards", [True, False])
def test_chains_settle_whatever_the_sequence(system, algorithm, backwards):
    """Lags that start in equilibrium: feed-through in initialization mode only, against the order of the sweep."""
    n = 60
    names = [f"lag[{k}]" for k in range(n)]
    instances = {name: ("Resting", {}) for name in (names[::-1] if backwards else names)}
    wires = [("source.n", "lag[0].u"), *((f"lag[{k - 1}].x", f"lag[{k}].u") for k in range(1, n))]
    result = go(system({"source": ("Count", {})} | instances, wires, stop_time=1.0, algorithm=algorithm))
    assert [result[f"{name}.x"][0] for name in names] == [10.0] * n


def loop(system, gain, bias=1.0, u=0.0, cls="Pass"):
    """b = u, a = gain b + bias: a loop of two feed-through blocks."""
    return system(
        {"a": ("Pass", {"gain": gain, "bias": bias}), "b": (cls, {"u": u})},
        [("a.y", "b.u"), ("b.y", "a.u")],
        stop_time=1.0,
    )


@ALGORITHMS
@BOTH
@pytest.mark.parametrize("gain", [0.5, -0.9, 0.999, -3.0, 7.0, -1e4])
def test_a_loop_is_solved(system, gain, kind, algorithm):
    """y = gain y + 1 has the root 1 / (1 - gain); exchange alone finds it only where |gain| < 1, and slowly near 1."""
    it = loop(system, gain)
    it.stepping.algorithm = algorithm
    result = go(it, kind=kind)
    assert result["a.y"][0] == pytest.approx(1.0 / (1.0 - gain), rel=1e-9)
    assert result["b.y"][0] == pytest.approx(result["a.y"][0], rel=1e-9)


def test_a_contraction_is_solved_by_exchange_alone(system, monkeypatch):
    monkeypatch.setattr(
        "railcosim.orchestrator.master.initialization.LoopSolver.solve", lambda *_: pytest.fail("Newton was called")
    )
    assert go(loop(system, 0.5))["a.y"][0] == pytest.approx(2.0, abs=1e-11)


def test_a_process_that_is_lost_while_a_loop_is_solved_is_no_matter_of_the_scenario(system, monkeypatch):
    def lose(*_):
        raise LostError("its process crashed", instance="a")

    monkeypatch.setattr("railcosim.orchestrator.master.initialization.LoopSolver.solve", lose)
    with pytest.raises(LostError, match="a: its process crashed"):
        go(loop(system, 2.0))


def test_a_loop_with_two_unknowns_that_is_not_linear(system):
    """The pair of the peers' comparison: 2 x1^2 + 5 x2 = 42, x1 - 6 x2 = 4, root x1 = 4.5571749758 near the start."""
    instances = {
        "x1": ("Pass", {"gain": 6.0, "bias": 4.0, "u": 0.1}),
        "square": ("Square", {"u": 4.6}),
        "x2": ("Pass", {"gain": -0.4, "bias": 8.4}),
    }
    wires = [("x1.y", "square.u"), ("square.y", "x2.u"), ("x2.y", "x1.u")]
    result = go(system(instances, wires, stop_time=1.0))
    assert result["x1.y"][0] == pytest.approx(4.5571749758, abs=1e-9)


def test_a_loop_without_solution_says_so(system):
    """y = y + 1, and y = y^2 + 1 over the reals."""
    for it, names in ((loop(system, 1.0), "a.y, b.y"), (loop(system, 1.0, cls="Square"), "a.y, b.y")):
        with pytest.raises(ScenarioError) as caught:
            go(it)
        message = str(caught.value)
        assert message.startswith(f"the initial values of {names} do not settle")
        assert "algebraic loop for which no solution was found" in message
        assert "put a component with memory into the loop" in message


@BOTH
def test_a_loop_of_booleans_without_solution_says_so(system, kind):
    it = system({"a": ("Not", {})}, [("a.y", "a.u")], stop_time=1.0)
    with pytest.raises(ScenarioError, match=r"the initial values of a\.y do not settle"):
        go(it, kind=kind)


def test_a_loop_whose_solution_cannot_be_reached_by_an_fmu_says_why(system, components):
    body = """
class Root(Base):
    '''y = 1 + sqrt(u - 2): no fixed point, and nothing below u = 2.'''

    u = Input("1", 5.0)
    y = Output("1")

    def outputs(self):
        return {"y": 1.0 - maths.sqrt(self.u - 2.0)}
"""
    it = System(stop_time=1.0, step=1.0)
    it.add("a", components(body, "root.py")("Root"))
    it.connect("a.y", "a.u")
    with pytest.raises((ScenarioError, FmuError), match="math domain error"):
        go(it)


def test_a_loop_in_which_a_delay_stands_is_solved_at_the_start_too(system):
    """The first value of a delayed connection is the initial one, and the initial one is consistent."""
    it = loop(system, -3.0)
    it.connections[0].delay = 1
    result = go(it)
    assert result["a.y"][0] == pytest.approx(0.25)
    assert result.checked.order.late == ()


# -------------------------------------------------------------------- values


@BOTH
@ALGORITHMS
def test_every_type_travels(system, kind, algorithm):
    names = (("m", "n"), ("off", "on"), ("said", "word"))
    wires = [(f"{a}.{output}", f"{b}.{into}") for a, b in ("ab", "bc") for output, into in names]
    instances = {
        "a": ("EveryType", {"m": 5, "off": False, "n": 8}),
        "b": ("EveryType", {}),
        "c": ("EveryType", {"on": True}),
    }
    result = go(system(instances, wires, stop_time=3.0, algorithm=algorithm), kind=kind)
    assert list(result["c.m"]) == [1, 2, 7, 11]  # from b's start, a's start, a's input
    assert list(result["c.off"]) == [1, 1, 0, 0]
    assert list(result["c.said"]) == ["a", "ab", "abb", "bbb"]
    assert result["c.said"].dtype == object
    assert result["c.m"].dtype == result["c.off"].dtype == np.float64


@BOTH
def test_conversion_scale_and_offset_reach_the_input(mine, components, kind):
    body = (
        "class Far(Base):\n    d = Memory('km', 2.0, output=True)\n    def update(self):\n        return {'d': 2.0}\n"
    )
    it = System(stop_time=1.0, step=1.0)
    it.add("far", components(body, "far.py")("Far"))
    it.add("near", components("class Near(Base):\n    d = Input('m')\n    y = Output('m')\n"
                              "    def outputs(self):\n        return {'y': self.d}\n", "near.py")("Near"))  # fmt: skip
    it.connect("far.d", "near.d", scale=0.5, offset=3.0)
    assert list(go(it, kind=kind)["near.y"]) == [1003.0, 1003.0]


@BOTH
def test_an_integer_feeds_a_real(system, kind):
    it = system({"a": ("EveryType", {"m": 7}), "b": ("Pass", {"gain": 0.5})}, [("a.m", "b.u")], stop_time=1.0)
    assert list(go(it, kind=kind)["b.y"]) == [3.5, 3.5]


def test_a_parameter_and_a_local_variable_may_be_connected(system):
    """They are recorded then, too."""
    it = system({"a": ("Pass", {"gain": 4.0}), "b": ("Pass", {})}, [("a.gain", "b.u")], stop_time=1.0)
    result = go(it)
    assert list(result["b.y"]) == [4.0, 4.0]
    assert list(result["a.gain"]) == [4.0, 4.0]


# -------------------------------------------------------------------- what stops a run


@ALGORITHMS
@pytest.mark.parametrize("value", ["nan", "inf", "-inf"])
def test_a_value_that_is_no_number_stops_the_run(system, foreign, xml, value, algorithm):
    """The blame falls on its source, not on one of ours that refuses it as an input."""
    v = xml["variable"]
    body = f"    def step(self, t, h, v):\n        v[1] = float({value!r}) if t + h > 2.5 else t + h\n"
    it = system({"end": ("Pass", {})}, algorithm=algorithm)
    it.add("bad", foreign([v("fine", "output"), v("y", "output")], body))
    it.connect("bad.y", "end.u")
    with pytest.raises(FmuError) as caught:
        go(it, kind="python")
    assert str(caught.value) == f"bad, t = 3 s: output 'y' is {value}"
    assert list(caught.value.run.time) == [0.0, 1.0, 2.0]


@pytest.mark.parametrize("wires", [[], [("source.n", "bad.u")]])
def test_a_value_that_is_no_number_at_the_start(system, foreign, xml, wires):
    """It is not taken for a loop that does not settle."""
    v = xml["variable"]
    body = "    def refresh(self, v):\n        v[1] = math.nan\n"
    it = system({"source": ("Count", {})})
    it.add("bad", foreign([v("u", "input", start=0.0), v("y", "output")], body))
    for wire in wires:
        it.connect(*wire)
    with pytest.raises(FmuError, match=r"^bad, t = 0 s: output 'y' is nan$"):
        go(it)


def test_giant_values_are_numbers(system, foreign, xml):
    """Their sum, which is what is looked at first, is not."""
    it = system({})
    body = "    def step(self, t, h, v):\n        v.update({0: 1.7e308, 1: 1.7e308})\n"
    it.add("big", foreign([xml["variable"](n, "output") for n in "xy"], body))
    assert go(it)["big.y"][-1] == 1.7e308


def test_an_observer_ends_a_run(workspace):
    """`Master` on models of the simplest kind: what it calls, and in which sequence."""
    calls = []

    class Still:
        name, time = "still", 0.0
        interface = type("Interface", (), {"variables": {}})

        def __getattr__(self, call):
            return lambda *arguments: calls.append((call, *arguments))

    master = Master({"still": Still()}, ["still"], [], {}, "gauss-seidel")
    master.initialize(0.5, 9.0)
    seen = []
    assert not master.run(0.5, 0.25, 10, 2, lambda k, rows: seen.append((k, list(rows))) or k < 3)
    assert seen == [(1, []), (2, [[1.0]]), (3, [])]
    assert master.steps == 3
    master.terminate()
    assert calls == [
        ("setup", 0.5, 9.0),
        ("enter_initialization",),
        ("exit_initialization",),
        ("step", 0.5, 0.25),
        ("step", 0.75, 0.25),
        ("step", 1.0, 0.25),
        ("terminate",),
    ]
