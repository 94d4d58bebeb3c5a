"""Values of formulas at every point: beside their definition, and beside rtamt."""

import random

import numpy as np
import pytest
from railcosim.orchestrator.errors import ExpressionError
from railcosim.orchestrator.evaluation import robustness, signals
from railcosim.orchestrator.evaluation.expressions import parse
from railcosim.orchestrator.evaluation.metrics import FUNCTIONS
from railcosim.orchestrator.evaluation.slack import decoded
from railcosim.orchestrator.evaluation.temporal import Formula, Points
from railcosim.orchestrator.evaluation.temporal.values import joined


def bounds(text, run, size=None):
    """The least and the most at every point, found at once or in pieces."""

    def look(node, scope):
        formula, count = Formula(scope, Points(scope.frame.run, 0)), run.points
        pieces = [formula.values(node, k, min(k + (size or count), count)) for k in range(0, count, size or count)]
        return joined(*pieces)

    found = parse(text, FUNCTIONS).apply(look, run)
    return np.column_stack([decoded(found.low), decoded(found.high)])


def test_a_formula_has_the_values_of_its_definition(case, logic):
    formula, text, run = case
    wanted = logic.direct(formula, run)
    assert bounds(text, run).tolist() == np.array(wanted).tolist()
    assert bounds(text, run, 4).tolist() == np.array(wanted).tolist()


many = pytest.mark.parametrize(
    "seeds",
    [
        pytest.param(range(500), marks=pytest.mark.long, id="hundreds"),
        *(pytest.param(range(k, k + 500), marks=pytest.mark.campaign, id=f"from {k}") for k in range(500, 5000, 500)),
    ],
)


@many
def test_many_formulas_have_the_values_of_their_definitions(logic, monkeypatch, seeds):
    for seed in seeds:
        source = random.Random(f"long {seed}")
        monkeypatch.setattr(signals, "BLOCK", source.choice([3, 4, 8192]))
        run = logic.drawn_run(source, source.randrange(1, 24), completed=source.random() < 0.7)
        formula = logic.drawn(source, source.randrange(1, 5))
        wanted = np.array(logic.direct(formula, run))
        assert np.array_equal(bounds(logic.written(formula), run, source.choice([None, 5])), wanted), seed


def agrees_with_rtamt(logic, seed):
    """Where the run tells a value, rtamt has the same: it takes what there is for all there will be."""
    rtamt = pytest.importorskip("rtamt", reason="rtamt needs Python below 3.13 and antlr4-python3-runtime 4.7")
    source = random.Random(f"rtamt {seed}")
    run = logic.drawn_run(source, 40, even=True)
    formula = logic.drawn(source, 3, bounds=(0, 1, 2), lengths=(0, 1, 3), endless=0.0)
    text = logic.written(formula)
    specification = rtamt.StlDiscreteTimeSpecification()
    for name in "xyz":
        specification.declare_var(name, "float")
    specification.set_sampling_period(500, "ms", 0.1)
    specification.spec = text.replace("s.", "")
    specification.parse()
    found = specification.evaluate({"time": run.time.tolist(), **{name: run[f"s.{name}"].tolist() for name in "xyz"}})
    ours = robustness(text, run)
    told = ~np.isnan(ours)
    assert np.array_equal(ours[told], np.array([value for _, value in found])[told]), text
    return told.any()


@pytest.mark.filterwarnings("ignore")
def test_rtamt_has_the_same_values(logic):
    assert sum(agrees_with_rtamt(logic, seed) for seed in range(12)) > 4


@many
@pytest.mark.filterwarnings("ignore")
def test_rtamt_has_the_same_values_of_many(logic, seeds):
    assert sum(agrees_with_rtamt(logic, seed) for seed in seeds) > 0.66 * len(seeds)


def test_what_looks_at_a_nan_is_one(logic, monkeypatch):
    run = logic.made(np.arange(8) * 0.5, {"s.x": [1, 2, 3, np.nan, 5, 6, 7, 8], "s.y": 1.0})
    for size in (3, 8192):
        monkeypatch.setattr(signals, "BLOCK", size)
        for text, missing in (
            ("always[0, 1] s.x > 0", [1, 2, 3]),
            ("once[0, 0.5] s.x > 0", [3, 4]),
            ("(s.y > 0) until[0, 1] (s.x > 0)", [1, 2, 3]),
            ("(s.x > 0) since[0.5, 0.5] (s.y > 0)", [3]),
            ("(s.x > 0) until[0, inf] (s.y > 0)", [0, 1, 2, 3]),
            ("rise(s.x > 4)", [3, 4]),
        ):
            told = bounds(text, run)
            assert np.flatnonzero(np.isnan(told).any(axis=1)).tolist() == missing, text


def test_an_if_chooses_between_formulas(logic):
    run = logic.made(np.arange(4) * 0.5, {"s.x": [1, 2, 3, 4], "s.y": [0, 1, 0, np.nan]})
    text = "(once[0, 1] (s.x > 2)) if s.y else (s.x > 0)"
    assert np.array_equal(bounds(text, run)[:, 0], [1, 0, 3, np.nan], equal_nan=True)


def test_an_interval_is_one(logic):
    run = logic.made(np.arange(4) * 0.5, {"s.x": 1.0}, parameters={"s.late": -1.0})
    for text in ("always[2, 1] s.x > 0", "always[0, s.late] s.x > 0", "always[inf, inf] s.x > 0"):
        with pytest.raises(ExpressionError, match="is no interval; its first time is 0 or later"):
            bounds(text, run)


def test_a_word_is_no_number(logic):
    run = logic.made(np.arange(4) * 0.5, {"s.x": 1.0})
    with pytest.raises(ExpressionError, match="'once' stands where a number is wanted"):
        bounds("(once s.x > 0) + 1 > 0", run)
