"""Studies that were never run: outputs by a formula, in place of runs."""

import numpy as np
import pandas as pd
import pytest
from railcosim.orchestrator.study.design import Dimension, Plan


@pytest.fixture
def studied():
    """Plan and table of a study of a function: `studied({"a.x": "0:1"}, f, count, design)`."""

    def make(vary, outputs, count, design="random", *, seed=1, failed=()):
        plan = Plan(tuple(Dimension.read(name, what) for name, what in vary.items()), design, count, seed)
        rows = plan.block(0, count)
        columns = {name: [row[name] for row in rows] for name in plan.names}
        x = [np.array(columns[name]) for name in plan.names]
        frame = pd.DataFrame(
            {"run": np.arange(count), **columns, "seed": [row.get("simulation.seed", 0) for row in rows]}
        )
        frame["status"] = ["failed" if k in failed else "completed" for k in range(count)]
        frame["error"] = [f"error of {k}" if k in failed else "" for k in range(count)]
        for name, output in outputs.items():
            values = np.array(output(*x), dtype=float)
            values[list(failed)] = np.nan
            frame[name] = values
            if name.startswith("margin."):
                words = np.where(np.isnan(values), None, np.where(values >= 0, "pass", "fail"))
                frame[name.replace("margin", "verdict")] = pd.Categorical(words)
        return frame, plan

    return make
