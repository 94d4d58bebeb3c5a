"""The linear model of the comfort scenario in cruise against Jacobians of the monolithic loop of `reference.py`.

The monolithic loop is differentiated by sixth-order central differences; it shares nothing with the FMUs, whose
derivatives come from CasADi through `fmi2GetDirectionalDerivative`. Only the states of the trains are in it: the
fallback for old data, silent here, adds states that the trains do not act on.
"""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from railcosim.orchestrator.linearization.closed_loop import linearize
from railcosim.orchestrator.run.execution import run

comfort_system = runpy.run_path(str(Path(__file__).with_name("comfort_system.py")))["comfort_system"]
pytest.importorskip("casadi")

AT = 200.0
N = 4
NAMES = [f"train[{i}].{name}" for name in ("position", "speed") for i in range(1, N + 1)]


def jacobian(f, point, steps):
    """Sixth-order central differences."""
    weights = {1: 3.0 / 4.0, 2: -3.0 / 20.0, 3: 1.0 / 60.0}
    columns = []
    for k, h in enumerate(steps):
        e = np.eye(len(point))[k] * h
        columns.append(sum(w * (f(point + m * e) - f(point - m * e)) for m, w in weights.items()) / h)
    return np.array(columns).T


def trains(model, matrix):
    """Rows (and columns, of a square matrix) of the trains' states, positions first."""
    at = [model.states.index(name) for name in NAMES]
    return matrix[np.ix_(at, at)] if matrix.shape[0] == matrix.shape[1] else matrix[at]


@pytest.fixture(scope="module", params=[False, True], ids=["bottom", "tanh"])
def cruise(request, reference):
    """Layer, the linear model at 200 s, and the state of the trains there."""
    model = linearize(comfort_system(reference, comfort=request.param, gust=0.5), AT)
    return request.param, model, np.array([model.values[name] for name in NAMES])


def test_the_continuous_model_is_the_jacobian_of_the_monolithic_loop(cruise, reference):
    """Every entry to 1e-8, and to 1e-6 of the largest in its column: gains on positions are some 1e-6 1/s2."""
    comfort, model, point = cruise
    gains = (reference.FIGURE_CONSISTENT, reference.FIGURE_CONSISTENT, 0.1)

    def slope(y):
        return np.concatenate([y[N:], reference.demand(y[:N], y[N:], *gains, comfort=comfort)])

    expected = jacobian(slope, point, [30.0] * N + [0.2] * N)
    found = trains(model, model.a)
    assert np.abs(found - expected).max() < 1e-8
    assert (np.abs(found - expected).max(axis=0) < 1e-6 * np.abs(expected).max(axis=0)).all()


def test_the_inputs_act_as_the_equations_say(cruise, reference):
    """A disturbance is an acceleration; the target acts through alpha and the slope of the comfort layer."""
    comfort, model, point = cruise
    b = trains(model, model.b)
    for i in range(N):
        expected = np.zeros(2 * N)
        expected[N + i] = 1.0
        assert b[:, model.inputs.index(f"train[{i + 1}].disturbance")] == pytest.approx(expected, abs=1e-12)
    gains = (reference.FIGURE_CONSISTENT, reference.FIGURE_CONSISTENT, 0.1)

    def by_target(r):
        return reference.demand(point[:N], point[N:], *gains, comfort=comfort, target=r[0])

    expected = jacobian(by_target, np.array([85.0]), [0.2])[:, 0]
    assert b[N:, model.inputs.index("target.value")] == pytest.approx(expected, abs=1e-9)


def test_the_fallback_is_silent(cruise):
    """Its weights decay with rejoin_time = 10 s whatever the trains do."""
    _, model, _ = cruise
    fallback = [k for k, name in enumerate(model.states) if name not in NAMES]
    at = [model.states.index(name) for name in NAMES]
    assert not model.a[np.ix_(fallback, at)].any()
    rates = np.diag(model.a)[fallback]
    assert sorted(rates) == pytest.approx([-0.1] * 12 + [0.0] * 4, abs=1e-15)


def test_the_bottom_layer_has_the_known_speeds_of_decay(reference):
    """Without the field: A = -alpha I - beta L, L the Laplacian of a path: -alpha - beta (2 - 2 cos(k pi / 4))."""
    system = comfort_system(reference, comfort=False)
    for name, instance in system.instances.items():
        if name.startswith("cruise"):
            instance.start["gamma"] = 0.0
    model = linearize(system, 50.0)
    gain = reference.FIGURE_CONSISTENT
    expected = [-gain - gain * (2.0 - 2.0 * np.cos(k * np.pi / N)) for k in range(N)]
    found = np.linalg.eigvals(trains(model, model.a)).real
    assert sorted(found) == pytest.approx(sorted([*expected, 0.0, 0.0, 0.0, 0.0]), abs=1e-12)


@pytest.mark.long
@pytest.mark.parametrize("comfort", [pytest.param(False, marks=pytest.mark.long), True], ids=["bottom", "tanh"])
def test_the_model_of_a_step_is_the_jacobian_of_the_sampled_map(reference, comfort):
    """Against runs of one step of the plain components from starts that differ."""
    base = comfort_system(reference, comfort=comfort, stop=0.1)
    arrived = linearize(comfort_system(reference, comfort=comfort), AT)
    point = np.array([arrived.values[name] for name in NAMES])
    shift = np.concatenate([np.full(N, point[0]), np.zeros(N)])
    point = point - shift  # the loop knows gaps only, and short numbers have more digits to spare

    def start(values):
        instances = dict(base.instances)
        for i in range(N):
            x, v = values[i], values[N + i]
            train = base.instances[f"train[{i + 1}]"]
            instances[train.name] = replace(train, start={**train.start, "position": x, "speed": v})
        return replace(base, instances=instances)

    def one_step(values):
        found = run(start(values), kind="plain")
        return np.array([found[name][-1] for name in NAMES])

    model = linearize(start(point), 0.0, sampled=True, kind="native")
    assert model.step == 0.1
    expected = jacobian(one_step, point, [20.0] * N + [0.5] * N)
    assert np.abs(trains(model, model.a) - expected).max() < 1e-8
