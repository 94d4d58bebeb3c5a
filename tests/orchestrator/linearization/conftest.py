"""What the tests of linear models share."""

import numpy as np
import pytest
from railcosim.orchestrator import System
from railcosim.orchestrator.linearization.closed_loop import Linearization


@pytest.fixture(scope="session")
def a_model():
    """Makes a linear model from bare matrices."""

    def make(a, b, c, *, step=None, outputs=None, states=None):
        a, b, c = (
            np.array(a, float),
            np.array(b, float).reshape(len(a), -1 if len(a) else 1),
            np.atleast_2d(np.array(c, float)),
        )
        return Linearization(
            a,
            b,
            c,
            np.zeros((len(c), b.shape[1])),
            tuple(states or (f"x{k}" for k in range(len(a)))),
            tuple(f"u{k}" for k in range(b.shape[1])),
            tuple(outputs or (f"y{k}" for k in range(len(c)))),
            step,
            0.0,
            System(),
            {},
            {},
        )

    return make
