"""Direct feed-through is found by running the equations, and what cannot be traced is refused with the remedy."""

import math

import numpy as np
import pytest
from railcosim.components import (
    ComfortCruise,
    Component,
    ComponentError,
    Gust,
    Input,
    Lookup,
    Memory,
    Output,
    Parameter,
    PointMassTrain,
    Schedule,
    State,
    maths,
)
from railcosim.components.tracing import (
    Sourced,
    TracingError,
    dependencies,
    feedthrough,
    initial_dependencies,
    used_inputs,
)


class Probe(Component):
    """One real input and output; a subclass says how."""

    a = Input("1", 0.5)
    b = Input("1", 0.25)
    v = Input("1", 1.0, shape=(3,))
    p = Parameter("1", 2.0)
    m = Memory("1", 0.0)
    y = Output("1")

    def update(self):
        return {"m": self.a}


def found(equation, **extra):
    """What y depends on when it is computed by ``equation``."""
    cls = type("Case", (Probe,), {"outputs": lambda self: {"y": equation(self)}, **extra})
    cls().outputs()
    return dependencies(cls())["y"]


PLAIN = np.array([1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("equation", "names"),
    [
        (lambda s: 1.0, ""),
        (lambda s: s.time, "time"),
        (lambda s: -s.a + abs(s.b) ** 2, "a b"),
        (lambda s: 2.0 * s.p / (1.0 + s.m), "p m"),
        (lambda s: maths.where(s.a > 0.0, s.b, s.p), "a b p"),
        (lambda s: maths.where(s.a > 0.0, s.b, s.v).sum(), "a b v[1] v[2] v[3]"),
        (lambda s: maths.tanh(s.a) + maths.clip(s.b, -s.p, s.p), "a b p"),
        (lambda s: maths.where(maths.logical_and(s.a > 1.0, s.b < 2.0), 1.0, 0.0), "a b"),
        (lambda s: s.v[1], "v[2]"),
        (lambda s: maths.total(s.v[:2] * s.v[1:]), "v[1] v[2] v[3]"),
        (lambda s: maths.total(s.v.reshape(3, 1)[::2]), "v[1] v[3]"),
        (lambda s: (PLAIN * s.a)[0], "a"),
        (lambda s: (s.a * PLAIN)[0], "a"),
        (lambda s: (PLAIN - s.v)[2], "v[3]"),
        (lambda s: maths.total(maths.where(s.a <= PLAIN, 1.0, s.b)), "a b"),
        (lambda s: maths.total(maths.where(s.a < PLAIN, 1.0, 0.0)), "a"),
        (lambda s: maths.total(maths.where((s.a * PLAIN) > 1.0, 1.0, 0.0)), "a"),
        (lambda s: maths.total(maths.where(s.v == PLAIN, 1.0, 0.0)), "v[1] v[2] v[3]"),
        (lambda s: maths.where(s.v < PLAIN, 1.0, 0.0)[0], "v[1]"),
        (lambda s: maths.where(s.v <= 2.0, 1.0, 0.0)[0], "v[1]"),
        (lambda s: maths.where(s.v > s.a, 1.0, 0.0)[0], "a v[1]"),
        (lambda s: maths.where(s.v >= s.v[::-1], 1.0, 0.0)[0], "v[1] v[3]"),
        (lambda s: maths.where(PLAIN > s.v, 1.0, 0.0)[1], "v[2]"),  # noqa: SIM300
        (lambda s: maths.total(maths.where(s.v != s.a, 1.0, 0.0)), "a v[1] v[2] v[3]"),
        (lambda s: PLAIN[0] * s.a + PLAIN[1], "a"),
        (lambda s: maths.piecewise_linear(s.a, PLAIN, s.v), "a v[1] v[2] v[3]"),
        (lambda s: maths.sign(s.a) * maths.floor(s.b), "a b"),
        (lambda s: 0.0 * s.a, "a"),
    ],
)
def test_dependencies_follow_the_equations(equation, names):
    """Reference: read off the formula."""
    assert found(equation) == frozenset(names.split())


def test_a_plain_branch_on_a_build_argument_is_fine(samples):
    assert dependencies(samples.Chain(masses=2))["tension[1]"] == {"stiffness[1]", "position[1]", "position[2]"}


def test_arrays_keep_their_elements_apart(samples):
    assert feedthrough(samples.Types())["closed[2]"] == {"doors[2]"}


def test_random_numbers_depend_on_time_and_seed(samples):
    direct = dependencies(samples.Dice())
    assert direct["noisy"] == {"u", "deviation", "time", "seed", "hold"}
    assert direct["pair_seen[1]"] == {"time", "seed", "slow_hold"}
    assert feedthrough(samples.Dice())["alone"] == frozenset()


def test_a_tape_depends_on_the_place_along_the_trip(samples):
    assert "trip_time" in dependencies(samples.Learner())["command"]
    assert feedthrough(samples.Learner())["command"] == {"trip_time"}


def test_a_text_depends_on_every_text(samples):
    """Texts are compared by equations, so they are not traced; the safe side is taken."""
    assert dependencies(samples.Types())["text"] == {"doors[1]", "doors[2]", "label", "remark"}
    assert "tape_file" not in dependencies(samples.Everything())["echo"]


def test_initial_values_pass_their_sources_on_to_the_outputs(samples):
    computed, outputs = initial_dependencies(samples.Estimator())
    assert computed == {"estimate": {"measured", "bias"}, "innovation": frozenset()}
    assert outputs["error"] == {"measured", "bias"}


def test_an_initial_array_of_no_elements(samples):
    class Empty(Component):
        x = State("1", shape=(0,))
        y = Output("1")

        def initial(self):
            return {"x": self.x}

        def outputs(self):
            return {"y": 1.0}

    assert initial_dependencies(Empty()) == ({}, {"y": frozenset()})


def test_feedthrough_of_the_shipped_components():
    """Reference: the design's closed loop: train and sources have none but acceleration, the controller has it."""
    train = feedthrough(PointMassTrain())
    assert train["position"] == train["speed"] == frozenset()
    assert train["acceleration"] == {"force", "disturbance", "line_resistance", "curve_resistance"}
    assert train["applied_force"] == {"force"}
    cruise = feedthrough(ComfortCruise())
    # A neighbour's position is extrapolated from its speed over its age, so the range depends on all three.
    heard = {f"{who}_{what}" for who in ("ahead", "behind") for what in ("position", "speed", "age")}
    neighbours = heard | {"has_ahead", "has_behind"}
    assert cruise["demand"] == neighbours | {"position", "speed", "target_speed", "has_leader", "leader_speed"}
    assert cruise["force"] == cruise["demand"] | {"line_resistance", "curve_resistance"}
    assert cruise["range_violated"] == neighbours | {"position"}
    assert cruise["degraded"] == {"ahead_age", "behind_age", "leader_age", "has_ahead", "has_behind", "has_leader"}
    assert feedthrough(Gust()) == {"acceleration": frozenset()}
    assert feedthrough(Schedule(points=3)) == {"value": frozenset()}


@pytest.mark.parametrize(
    "equation",
    [
        lambda s: 1.0 if s.a > 0.0 else 0.0,
        lambda s: s.a > 0.0 and s.b > 0.0,
        lambda s: not s.a,
        lambda s: max(s.a, s.b),
        lambda s: float(s.a),
        lambda s: int(s.a),
        lambda s: PLAIN[s.a],
        lambda s: math.tanh(s.a),
        lambda s: [x for x in s.v if x > 0.0],
        lambda s: np.where(s.v > 0.0, 1.0, 0.0).sum(),
        lambda s: np.maximum(s.v, 0.0).sum(),
    ],
)
def test_asking_for_truth_or_a_plain_number_names_the_remedy(equation):
    cls = type("Case", (Probe,), {"outputs": lambda self: {"y": equation(self)}})
    with pytest.raises(TracingError, match=r"Case\.outputs.*railcosim\.components\.maths"):
        dependencies(cls())


@pytest.mark.parametrize("equation", [lambda s: np.tanh(s.a), lambda s: round(s.a), lambda s: f"{s.a:.3f}"])
def test_anything_else_that_fails_is_named_with_its_cause(equation):
    cls = type("Case", (Probe,), {"outputs": lambda self: {"y": equation(self)}})
    with pytest.raises(
        TracingError,
        match=r"Case\.outputs cannot be traced \((Type|Attribute)Error: .*\) \(at test_tracing\.py:\d+, .*\): on val",
    ):
        dependencies(cls())


class Whole(Probe):
    """With every method that returns values."""

    x = State("1", 0.0)

    def outputs(self):
        return {"y": self.x}

    def derivatives(self):
        return {"x": self.a}


@pytest.mark.parametrize("method", ["outputs", "derivatives", "update", "initial", "keep"])
def test_a_misspelt_name_is_told_with_the_nearest_and_the_authors_line(method):
    """In every method that is run, through helpers too."""

    def misspelt(self):
        return self._half()

    cls = type("Case", (Whole,), {method: misspelt, "_half": lambda self: {"y": 0.5 * self.tiem}})
    with pytest.raises(ComponentError) as told:
        used_inputs(cls())
    assert not isinstance(told.value, TracingError)
    line = misspelt.__code__.co_firstlineno + 3
    expected = f"Case.{method}: Case has no 'tiem'; did you mean 'time'? (at test_tracing.py:{line}, "
    assert str(told.value).startswith(expected)


@pytest.mark.parametrize(
    ("method", "said"),
    [
        ("outputs", "Case.outputs returns no value of ['y'] (test_tracing.py:"),
        ("update", "Case.update returns no value of ['m'] (test_tracing.py:"),
        ("derivatives", "Case.derivatives returns no value of ['x'] (test_tracing.py:"),
    ],
)
def test_what_a_method_forgets_is_told_before_a_run(method, said):
    cls = type("Case", (Whole,), {method: lambda self: {}})
    with pytest.raises(ComponentError) as told:
        used_inputs(cls())
    assert str(told.value).startswith(said)
    assert not isinstance(told.value, TracingError)


def test_initial_is_named_where_it_fails():
    cls = type("Case", (Probe,), {"initial": lambda self: {"m": float(self.a)}, "outputs": lambda self: {"y": 1.0}})
    with pytest.raises(TracingError, match=r"Case\.initial"):
        initial_dependencies(cls())


def test_a_wrong_shape_is_told_while_tracing():
    cls = type("Case", (Probe,), {"outputs": lambda self: {"y": self.v}})
    with pytest.raises(ComponentError, match=r"Case\.outputs: 'y' has shape \(3,\), declared \(\)"):
        dependencies(cls())


def test_a_traced_value_is_not_hashable():
    with pytest.raises(TypeError):
        hash(Sourced(frozenset()))


class EachItsInput(Component):
    """Every method reads an input of its own; `spare` is read by none."""

    to_output, to_rate, to_start, to_memory, to_keep, spare = (Input("1") for _ in range(6))
    word = Input("1", "")
    y = Output("1")
    x = State("1")
    kept = State("1")
    m = Memory("1", 0.0)
    sample_time = Parameter("s", 1.0)

    def initial(self):
        return {"kept": self.to_start}

    def derivatives(self):
        return {"x": self.to_rate, "kept": 0.0}

    def outputs(self):
        return {"y": 2.0 * self.to_output}

    def update(self):
        return {"m": self.m + self.step * self.to_memory}

    def keep(self):
        return self.to_keep > 0.0


def test_an_input_is_used_whichever_method_reads_it():
    assert used_inputs(EachItsInput()) == {"to_output", "to_rate", "to_start", "to_memory", "to_keep", "word"}


def test_a_port_has_inputs_that_a_law_does_without():
    every = {name for slot in ComfortCruise().of(Input) for name in slot.scalars}
    assert every - used_inputs(ComfortCruise()) == {"leader_position"}


def test_what_is_looked_up_depends_on_all_that_says_where():
    surface = Lookup([[0.0, 1.0], [0.0, 1.0]], [[1.0, 2.0], [3.0, 4.0]])

    class Looking(Probe):
        def outputs(self):
            return {"y": surface(self.a, self.p)}

    class Multiplying(Probe):
        def outputs(self):
            return {"y": maths.product(np.ones((1, 2)), [1.0, self.b])[0]}

    class Stepping(Probe):
        def outputs(self):
            return {"y": maths.piecewise_constant(self.m, [0.0, 1.0], [2.0, 3.0])}

    assert dependencies(Looking())["y"] == {"a", "p"}
    assert dependencies(Multiplying())["y"] == {"b"}
    assert dependencies(Stepping())["y"] == {"m"}
