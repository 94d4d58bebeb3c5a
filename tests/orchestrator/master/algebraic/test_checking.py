"""What the kernel is given to solve algebraic loops by is checked."""

from functools import partial

import numpy as np
import pytest
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.plans.layout import PARTY, SOLVER, TERM

pytestmark = pytest.mark.skipif(compiled.kernel is None, reason="installed without the compiled step loop")


def call(arguments, **how):
    return compiled.kernel.run(*(arguments | how).values())


def changed(array, field, value, at=0):
    result = array.copy()
    result[field][at] = value
    return result


def solving(arguments, *, array="solvers", at=0, inside=2, place=0, **of):
    """A first operation that solves for a value, by those behind it, but for one thing; one that asks is among them."""
    count = len(arguments["operations"])
    made = {"solvers": np.zeros(1, SOLVER), "parties": np.zeros(1, PARTY), "terms": np.zeros(3, TERM)}
    solver = {"real_count": 1, "other_count": 1, "attempts": 1, "party_count": 1, "evaluating": 1, "deriving": 2}
    party = {"function": 1, "writing": 1, "written": 1, "reading": 1, "read": 1, "ask": 2, "known_count": 1}
    for name, value in (solver | {"end": 3}).items():
        made["solvers"][name] = value
    for name, value in (party | {"row_count": 1, "whole_count": 1}).items():
        made["parties"][name] = value
    made["terms"]["count"] = 1
    for name, value in of.items():
        made[array][name][at] = value
    kinds, indices = [16, inside, 17], [0, int(arguments["operations"]["index"][-1]), 0]
    operations = arguments["operations"][[0, count - 1, 0]].copy()
    operations["kind"], operations["index"] = kinds, indices
    return {
        **made,
        "work": np.zeros(1000),
        "passed": np.array([0, place]),
        "operations": operations,
        "parts": np.array([3]),
        "disturbed": np.zeros(3, np.int64),
    }


WRONG = {
    "a solver that is not there": lambda a: solving(a) | {"solvers": np.zeros(0, SOLVER)},
    "a party that is not there": lambda a: solving(a, party_count=0) | {"parties": np.zeros(0, PARTY)},
    "a solver of several threads": lambda a: (
        solving(a) | {"parts": np.array([1, 2, 3, 3]), "places": np.tile(a["places"], 2)}
    ),
    "a solver in a solver": partial(solving, inside=16),
    "a loop in a solver": partial(solving, inside=9),
    "a loop that ends in a solver": partial(solving, inside=11),
    "a value that is not there is solved for": partial(solving, place=10**6),
    **{
        f"a solver whose {name} is {value}": partial(solving, **{name: value})
        for name, value in [
            *(("real_count", -1), ("real_count", 3), ("other_count", -1), ("other_count", 2), ("begin", -1)),
            *(("party_count", -1), ("party_count", 2), ("party", -1), ("work", 10**6), ("evaluating", 0)),
            *(("deriving", 0), ("end", 1), ("end", 4)),
        ]
    },
    **{
        f"a party whose {name} is {value}": partial(solving, array="parties", **{name: value})
        for name, value in [
            *(("term", -1), ("known_count", -1), ("known_count", 4), ("row_count", -1), ("row_count", 3)),
            *(("whole_count", -1), ("whole_count", 2), ("writing", 0), ("writing", 2), ("written", 3), ("reading", 0)),
            *(("reading", 2), ("read", 3), ("ask", 1), ("ask", 3), ("function", 0)),
        ]
    },
    "a party that asks by another operation": lambda a: (
        solving(a, deriving=1) | {"parties": changed(solving(a)["parties"], "ask", 1)}
    ),
    **{
        f"a term {at} whose {name} is {value}": partial(solving, array="terms", at=at, **{name: value})
        for at in (0, 1, 2)
        for name, value in [("of", -1), ("of", 10**6), ("count", 0), ("count", 2**21), ("element", -1), ("element", 1)]
    },
    "an input of an entry of an unknown change": lambda a: solving(a) | {"entries": changed(a["entries"], "change", 1)},
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_solver_that_is_not_sound_is_refused(arguments, wrong):
    with pytest.raises(ValueError, match=r"^kernel: "):
        call(arguments, **WRONG[wrong](arguments))


def test_a_sound_solver(arguments):
    """Where nothing of it is wrong; see `WRONG`. Nothing moves, and so the value that is there is left."""
    assert call(arguments, **solving(arguments, other_count=0)) == (4, 4, 1)
