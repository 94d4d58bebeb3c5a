"""What the tests of searches share: a line of five that follow a schedule, and searches over functions of numbers."""

import numpy as np
import pytest
from railcosim.orchestrator import System
from railcosim.orchestrator.study.campaign import Dataset
from railcosim.orchestrator.study.design import Dimension
from railcosim.orchestrator.study.rows import Row
from railcosim.orchestrator.study.search.evaluations import Evaluations
from railcosim.orchestrator.study.search.space import Space


@pytest.fixture
def lagging(mine):
    """A lag that follows a schedule; its requirement holds as it stands, with a margin of 0.5."""

    def build(**values):
        system = System(stop_time=2.0, step=0.1, requirements={"low": "always lag.x <= 1.5"}, name="lagging", **values)
        system.add("target", "Schedule", {"points": 1}, values=1.0)
        system.add("lag", mine("Lag"), rate=5.0)
        system.connect("target.value", "lag.u")
        return system

    return build


@pytest.fixture
def searched(tmp_path):
    """A space of numbers between 0 and 1, nominally `nominal`, and the runs of a function of them.

    The function gives a margin of the requirement `held`; what it raises is a failed run.
    """

    def build(margin, nominal=(0.5, 0.5), **kept):
        names = [f"it.x{k}" for k in range(len(nominal))]
        space = Space(
            tuple(Dimension.parse(f"{name}=0:1") for name in names), (), dict(zip(names, nominal, strict=True))
        )

        def evaluate(points):
            for point in points:
                ran.append(dict(point[1]))
                yield point, row(point[1])

        def row(changes):
            try:
                value = margin(np.array([changes.get(name, x) for name, x in space.nominal.items()]))
            except ArithmeticError as error:
                return Row("failed", str(error))
            verdict = "pass" if value >= 0.0 else "fail"
            return Row("completed", metrics={"value": value}, verdicts={"held": verdict}, margins={"held": value})

        ran = []
        evaluations = Evaluations(evaluate, Dataset(tmp_path, space.keys, ["held"], 0), **kept)
        return space, evaluations, ran

    return build
