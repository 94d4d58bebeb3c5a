"""A coupling that diverges is recognised, and growth that is physical is not taken for it."""

from types import SimpleNamespace

import numpy as np
import pytest
from railcosim.fmus.annotation import Annotation
from railcosim.orchestrator.errors import CouplingError, FmuError
from railcosim.orchestrator.names import SignalName
from railcosim.orchestrator.run.watching.divergence import explain_divergence, find_growth, sources_in_cycles
from railcosim.orchestrator.system import Connection, System
from railcosim.orchestrator.wiring import Link

STEP = 0.1


def growth(values, step=STEP, every=1, **how):
    values = np.asarray(values, dtype=float)
    return find_growth(np.arange(len(values)) * every * step, values, step, **how)


# -------------------------------------------------------------------- growth that is none of nature's


@pytest.mark.parametrize("factor", [1.25, 1.8, 7.0, -1.05, -1.3, -20.0])
def test_geometric_growth(factor):
    found = growth(3.0 * factor ** np.arange(700 if factor == -1.05 else 90))
    assert found.factor == pytest.approx(abs(factor), rel=1e-6)
    assert found.since == 0.0


@pytest.mark.parametrize("angle", [0.3, 0.9, 2.0, 3.0])
@pytest.mark.parametrize("phase", [0.0, 0.7, 1.5])
def test_an_oscillation_that_grows(angle, phase):
    """Peaks are what counts, not the nodes between them."""
    k = np.arange(120)
    found = growth(1.5**k * np.cos(angle * k + phase))
    assert found.factor == pytest.approx(1.5, rel=0.03)


def test_growth_that_begins_late():
    """Out of an even course; seen once it is larger than that."""
    values = np.concatenate([50.0 + np.sin(np.arange(100)), 50.0 + 1e-6 * 1.8 ** np.arange(80)])
    found = growth(values)
    assert found.factor == pytest.approx(1.8, rel=0.05)
    assert 12.0 <= found.since <= 14.5


def test_sparse_rows_tell_the_same():
    """Ten steps in each row: 1.5 in each step."""
    found = growth(1.5 ** (10.0 * np.arange(12)), every=10)
    assert found.factor == pytest.approx(1.5, rel=1e-6)


def test_growth_ever_faster():
    """Squares: 2, 4, 16, 256 and on to infinity, which an FMU fails of."""
    values = [2.0 ** (2**k) for k in range(9)]
    assert growth(values) is None
    assert growth(values, failed=True).factor > 10.0


def test_slow_growth_beyond_everything():
    """Of 2 % in each step, once there is nothing like it in the world."""
    k = np.arange(6000)
    found = growth(1.02**k * np.cos(0.2 * k))
    assert found.factor == pytest.approx(1.02, rel=1e-3)
    assert growth((1.02**k * np.cos(0.2 * k))[:1500]) is None


def test_values_that_are_no_numbers_any_more_are_passed_over():
    values = np.append(2.0 ** np.arange(60), [np.inf, np.nan])
    assert growth(values).factor == pytest.approx(2.0)


# -------------------------------------------------------------------- growth that may be


TIME = np.arange(0.0, 600.0, STEP)
PHYSICAL = {
    "position of a train": 83.0 * TIME,
    "energy of a train": 0.5 * 8e5 * np.minimum(83.0, 0.8 * TIME) ** 2,
    "integral of an integral of an integral": TIME**3,
    "a tenth power": TIME**10,
    "growth in 2 s by a factor of e": np.exp(0.5 * TIME[:1000]),
    "an unstable plant, ten steps in its time constant": np.exp(TIME[:300]),
    "flutter": np.exp(0.2 * TIME[:1000]) * np.sin(6.0 * TIME[:1000]),
    "rest": np.zeros(1000),
    "a jump": np.where(TIME < 300.0, 1.0, 1e12),
    "a relay": 1e9 * (-1.0) ** np.arange(1000),
    "a relay that decays": 1e9 * (-0.9) ** np.arange(1000),
    "rounding errors": 1e-16 * 1.5 ** np.arange(80),
    "what grows and comes back": np.concatenate([2.0 ** np.arange(60), 2.0 ** np.arange(60)[::-1]]),
    "what grows and stays": np.concatenate([2.0 ** np.arange(60), np.full(200, 2.0**60)]),
    "a start from nothing": 1e5 * (1.0 - np.exp(-TIME)),
    "one point": np.array([1e9]),
    "nothing": np.array([]),
}


@pytest.mark.parametrize("name", PHYSICAL)
@pytest.mark.parametrize("every", [1, 10])
def test_no_false_alarm(name, every):
    """Of any signal that a train or an unstable plant may have, at every step or at some."""
    assert growth(PHYSICAL[name][::every], every=every) is None


@pytest.mark.parametrize("name", [n for n in PHYSICAL if n != "what grows and comes back"])
def test_no_false_alarm_of_a_run_that_failed_of_something_else(name):
    assert growth(PHYSICAL[name], failed=True) is None


def test_the_usual_size_of_a_variable_counts():
    """1e10 Pa are nothing where 1e9 are the rule."""
    values = 1.5 ** np.arange(57)
    assert growth(values) is not None
    assert growth(values, size=1e9) is None


# -------------------------------------------------------------------- whose, and what to do


class Recorded(dict):
    """Signals over time."""

    step = STEP

    def names(self):
        return self.keys()

    @property
    def time(self):
        return np.arange(len(next(iter(self.values())))) * STEP


def links(*pairs):
    ends = [(SignalName.parse(a), SignalName.parse(b), Connection(a, b)) for a, b in pairs]
    return [Link(a, b, 1.0, 0.0, 0, False, connection) for a, b, connection in ends]


def model(direct=False, **of):
    variables = {
        name: SimpleNamespace(
            type="Real", nominal=None, causality="output", dependencies=frozenset("u" if direct else "")
        )
        for name in ("x", "y", "z")
    }
    facts = {"annotation": Annotation(), "sampled": False, "can_save_state": True, "interpolates_inputs": True}
    return SimpleNamespace(variables=variables, **facts | of)


GROWS, CALM = 2.0 ** np.arange(40), np.sin(np.arange(40))


def explain(*pairs, error=None, models=None, signals=None, **how):
    found = links(*pairs)
    sources = [".".join(link.source) for link in found]
    results = Recorded(dict.fromkeys(sources, GROWS) | (signals or {}))
    interfaces = {name.split(".")[0]: model() for pair in pairs for name in pair} | (models or {})
    told = explain_divergence(System(**how), interfaces, found, [results], error)
    return "" if told is None else told.message


def test_the_signals_of_the_cycle_are_named():
    told = explain(("a.x", "b.u"), ("b.y", "a.u"), ("c.x", "a.w"), ("b.z", "d.u"))
    assert told == (
        "the coupling through a.x, b.y diverges: it grows by a factor of 2 per communication step since t = 0 s; take "
        'a smaller step, or algorithm = "iterative" with extrapolation = 1; if it grows alike with any, the system '
        "itself is unstable"
    )


def test_the_record_of_it():
    told = explain_divergence(System(), {"a": model()}, links(("a.x", "a.u")), [Recorded({"a.x": -GROWS})])
    assert (told.kind, told.instances, told.signal) == ("diverging", ("a",), "a.x")
    assert (told.since, told.worst, told.worst_time) == (0.0, -(2.0**39), pytest.approx(3.9))


def test_slow_growth_is_told_by_its_swings():
    """Half again in each swing: told of a run that came to its end, and not as the cause of a failure."""
    swings = {"a.x": 1.5 ** (0.3 * np.arange(120) / np.pi) * np.sin(0.3 * np.arange(120))}
    told = explain(("a.x", "a.u"), signals=swings)
    assert "a.x diverges: its swings become larger, each 1.5" in told
    assert explain(("a.x", "a.u"), signals=swings, error=FmuError("something else")) == ""


def test_the_end_of_a_run_is_looked_at_where_the_rows_do_not_tell():
    rows, end = Recorded({"a.x": CALM[:4]}), Recorded({"a.x": GROWS})
    for seen in ([rows, end], [end, rows]):
        assert explain_divergence(System(), {"a": model()}, links(("a.x", "a.u")), seen).worst == 2.0**39
    assert explain_divergence(System(), {"a": model()}, links(("a.x", "a.u")), [rows]) is None


def test_what_is_to_be_seen_of_it():
    whole = model()
    whole.variables["y"].type = "Integer"
    found = links(("a.x", "b.u"), ("b.y", "a.u"), ("b.z", "a.v"), ("a.y", "c.u"))
    interfaces = {"a": model(), "b": whole, "c": model()}
    assert [str(x) for x in sources_in_cycles(System(), interfaces, found)] == ["a.x", "b.z"]
    assert not list(sources_in_cycles(System(algorithm="adaptive"), interfaces, found))


def test_of_many_signals_some_are_named():
    pairs = [(f"a{k}.x", f"a{(k + 1) % 9}.u") for k in range(9)]
    assert "through a0.x, a1.x, a2.x, a3.x, ... diverges" in explain(*pairs)


def test_of_a_cycle_only_what_grows_is_named():
    told = explain(("a.x", "b.u"), ("b.y", "a.u"), signals={"b.y": CALM})
    assert told.startswith("the coupling through a.x diverges")


def test_growth_outside_of_cycles_is_nobody_s_fault():
    assert explain(("a.x", "b.u"), ("b.y", "c.u")) == ""
    assert explain(("a.x", "b.u"), ("b.y", "a.u"), ("a.z", "c.u"), signals={"a.x": CALM, "b.y": CALM}) == ""


def test_an_instance_may_be_coupled_with_itself():
    assert explain(("a.x", "a.u")).startswith("the coupling through a.x diverges")


def test_what_is_no_real_number_does_not_grow():
    whole = model()
    whole.variables["x"].type = "Integer"
    assert explain(("a.x", "a.u"), models={"a": whole}) == ""


def test_a_steady_factor_is_told_and_no_other():
    assert "more than a thousandfold per communication step" in explain(
        ("a.x", "a.u"), signals={"a.x": 1e4 ** np.arange(40.0)}
    )


@pytest.mark.parametrize(
    ("how", "told"),
    [
        ({"can_save_state": False}, "s; take a smaller step; if"),
        ({"interpolates_inputs": False}, 'smaller step, or algorithm = "iterative"; if'),
        (
            {"can_save_state": False, "sampled": True},
            'or algorithm = "iterative" with extrapolation = 1; if',
        ),
        (
            {"direct": True},
            's; let its algebraic loop be solved at each communication point by algebraic_loops = "solve"',
        ),
    ],
)
def test_advice_is_such_that_can_be_followed(how, told):
    assert told in explain(("a.x", "b.u"), ("b.y", "a.u"), models={"a": model(**how), "b": model(**how)})


def test_advice_for_iterative():
    pairs = ("a.x", "b.u"), ("b.y", "a.u")
    assert "take a smaller step, or let inputs move over it by extrapolation = 1; if" in explain(
        *pairs, algorithm="iterative"
    )
    assert "s; take a smaller step; if" in explain(*pairs, algorithm="iterative", extrapolation=1)


def test_adaptive_looks_after_itself():
    assert explain(("a.x", "b.u"), ("b.y", "a.u"), algorithm="adaptive") == ""


def test_a_run_that_failed_needs_fewer_rows():
    few = {"a.x": 10.0 ** (3 * np.arange(5.0))}
    assert explain(("a.x", "a.u"), signals=few) == ""
    assert explain(("a.x", "a.u"), signals=few, error=CouplingError("other")) == ""
    assert "diverges" in explain(("a.x", "a.u"), signals=few, error=FmuError("not a number"))


def test_an_error_can_be_explained():
    error = FmuError("fmi2DoStep failed", instance="a", time=2.0, status="error", log=["[error] nan"])
    error.explain("the coupling diverges")
    assert str(error) == "a, t = 2 s, status error: fmi2DoStep failed; the coupling diverges\n    [error] nan"
