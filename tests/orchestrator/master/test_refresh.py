"""Feed-through at communication points: in which order it is refreshed, which numbers that gives, who is left alone."""

import json
from pathlib import Path

import numpy as np
import pytest
from railcosim.orchestrator.errors import FmuError, ScenarioError
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import Event, System
from scipy.linalg import expm

COMPONENTS = str(Path(__file__).parents[2] / "scenarios" / "textbook_components.py")
M1, K1, D1, M2, K2, D2, KC, DC = 1.0, 2.0, 0.1, 1.5, 3.0, 0.2, 4.0, 0.3


def two_masses(**how):
    """Two masses on springs: the left one is given a force, which the right one computes from where the left one is."""
    it = System(**{"stop_time": 2.0, "step": 0.05, "algorithm": "jacobi", "refresh": True} | how)
    fine = {"max_step": 5e-4}
    it.add("left", f"{COMPONENTS}:Left", mass=M1, stiffness=K1, damping=D1, x=1.0, v=0.0, **fine)
    it.add("right", f"{COMPONENTS}:Right", mass=M2, stiffness=K2, damping=D2, x=0.0, v=0.0, **fine)
    it.instances["right"].start.update(coupling=KC, coupling_damping=DC)
    it.connect("right.force", "left.force")
    it.connect("left.x", "right.other_x")
    it.connect("left.v", "right.other_v")
    return it


def held(a, b, h):
    """The exact map of x' = a x + b u over a step with u held."""
    a, b = np.array(a), np.array(b)
    n, m = b.shape
    whole = expm(h * np.block([[a, b], [np.zeros((m, n + m))]]))
    return whole[:n, :n], whole[:n, n:]


def coupled_map(h, count):
    """Rows x1, v1, x2, v2, force: the force of each point, and both masses stepped from it."""
    a1, b1 = held([[0.0, 1.0], [-K1 / M1, -D1 / M1]], [[0.0], [1.0 / M1]], h)
    inside = [[0.0, 1.0], [-(K2 + KC) / M2, -(D2 + DC) / M2]]
    a2, b2 = held(inside, [[0.0, 0.0], [KC / M2, DC / M2]], h)
    left, right, rows = np.array([1.0, 0.0]), np.zeros(2), []
    for _ in range(count + 1):
        force = KC * (right[0] - left[0]) + DC * (right[1] - left[1])
        rows.append([*left, *right, force])
        left, right = a1 @ left + b1[:, 0] * force, a2 @ right + b2 @ left
    return np.array(rows)


NAMES = ("left.x", "left.v", "right.x", "right.v", "right.force")


def off(result, rows):
    return max(np.abs(result[name] - rows[:, k]).max() for k, name in enumerate(NAMES))


@pytest.mark.parametrize("kind", ["native", "plain"])
def test_every_value_is_of_its_point(kind):
    """Against the coupled map by matrix exponentials; without a refresh the force is that of a step ago."""
    rows = coupled_map(0.05, 40)
    assert off(run(two_masses(), kind=kind), rows) < 1e-12
    assert off(run(two_masses(refresh=False), kind=kind), rows) > 0.1


def test_isolated_instances_and_native_ones_have_the_same_bits():
    it = two_masses(stop_time=0.5)
    near = run(it, kind="native")
    it.instances["right"].isolate = True
    far = run(it, kind="native")
    assert all(np.array_equal(near[name], far[name]) for name in near.names())


def test_gauss_seidel_shows_feed_through_of_the_point():
    result = run(two_masses(algorithm="gauss-seidel"), kind="plain")
    force = KC * (result["right.x"] - result["left.x"]) + DC * (result["right.v"] - result["left.v"])
    assert result["right.force"] == pytest.approx(force, abs=1e-14)
    stale = run(two_masses(algorithm="gauss-seidel", refresh=False), kind="plain")
    assert np.array_equal(stale["left.x"], result["left.x"])  # a sweep takes the same inputs with and without
    assert np.abs(stale["right.force"] - result["right.force"]).max() > 0.1


def chain(mine, count, **how):
    """A ramp through amplifiers, declared against their order."""
    it = System(**{"stop_time": 1.0, "step": 0.25, "algorithm": "jacobi", "refresh": True} | how)
    for k in reversed(range(count)):
        it.add(f"p{k}", mine("Pass"), gain=2.0)
    it.add("ramp", mine("Course"), a=1.0, b=1.0)
    it.connect("ramp.y", "p0.u")
    for k in range(1, count):
        it.connect(f"p{k - 1}.y", f"p{k}.u")
    return it


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel", "adaptive"])
def test_a_chain_is_refreshed_in_its_order(mine, algorithm):
    it = chain(mine, 4, algorithm=algorithm)
    if algorithm == "adaptive":
        it.add("sum", mine("Integral"))
        it.connect("p3.y", "sum.u")
    result = run(it, kind="plain")
    for k in range(4):
        assert result[f"p{k}.y"] == pytest.approx(2.0 ** (k + 1) * (1.0 + result.time), rel=1e-12)


def test_lists_that_name_what_there_is_not_hinder_nothing(foreign, xml):
    """Two FMUs of two chains each, in a circle if every output depends on every input: it settles all the same."""
    v = xml["variable"]
    both = ["u", "w"]
    shown = [v("u", "input", start=0.0), v("w", "input", start=0.0)]
    shown += [v("y", "output", dependencies=both), v("z", "output", dependencies=both)]
    fmu = foreign(shown, "    def refresh(self, v):\n        v[2], v[3] = v[0] + 1.0, 10.0 * v[1]\n")
    it = System(stop_time=1.0, step=0.5, algorithm="jacobi", refresh=True)
    it.add("a", fmu)
    it.add("b", fmu)
    it.connect("a.y", "b.u")
    it.connect("b.y", "a.w")
    it.connect("a.z", "b.w")
    result = run(it)
    assert list(result["a.y"]) == [1.0] * 3
    assert list(result["b.z"]) == [200.0] * 3
    assert result.coupling["refresh"]["refreshed"] == ["a", "b"]


def test_a_loop_that_does_not_settle_stays_as_it_was(mine):
    """It is solved where it is to be, and what follows from it is refreshed after that."""
    it = System(stop_time=1.0, step=0.25, algorithm="jacobi", refresh=True, algebraic_loops="solve")
    it.add("after", mine("Pass"), gain=10.0)
    it.add("p", mine("Pass"), gain=1.0, bias=4.0)
    it.add("q", mine("Pass"), gain=-3.0)
    it.connect("p.y", "q.u")
    it.connect("q.y", "p.u")
    it.connect("p.y", "after.u")
    result = run(it, kind="plain")
    assert result["p.y"] == pytest.approx(np.ones(5))
    assert result["after.y"] == pytest.approx(np.full(5, 10.0))


def test_sampled_components_hold_what_belongs_to_their_sample(mine):
    it = System(stop_time=1.0, step=0.25, algorithm="jacobi")
    it.add("ramp", mine("Course"), b=1.0)
    it.add("block", mine("Sampled"))
    it.connect("ramp.y", "block.u")
    before = run(it, kind="plain")
    it.stepping.refresh = True
    after = run(it, kind="plain")
    assert all(np.array_equal(before[name], after[name]) for name in before.names())


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_a_delay_is_one_point_of_the_refreshed_value(mine, algorithm):
    it = chain(mine, 3, algorithm=algorithm)
    it.connections[1].delay = 1
    result = run(it, kind="plain")
    y = 2.0 * (1.0 + result.time)
    assert result["p0.y"] == pytest.approx(y)
    assert result["p1.y"][1:] == pytest.approx(2.0 * y[:-1])
    assert result["p2.y"][1:] == pytest.approx(4.0 * y[:-1])


def test_an_event_is_passed_on_at_its_point(mine):
    it = chain(mine, 3)
    it.events = [Event("ramp.y", "override", at=0.5, value=7.0)]
    result = run(it, kind="plain")
    assert list(result["p2.y"][2:]) == [56.0] * 3


def test_one_that_refuses_is_left_alone_and_told(species, tmp_path, mine):
    """As FMI 2.0 lets an FMU: it cannot be read between being set and the next step."""
    it = System(stop_time=1.0, step=0.25, algorithm="jacobi", refresh=True)
    it.add("ramp", mine("Course"), a=1.0, b=1.0)
    it.add("shy", species(["u"], "-DSHY"), d=1.0)
    it.add("p", mine("Pass"), gain=2.0)
    it.connect("ramp.y", "shy.u")
    it.connect("ramp.y", "p.u")
    result = run(it, output=tmp_path / "out")
    assert list(result["shy.y"]) == [1.0, 1.0, 1.25, 1.5, 1.75]
    assert list(result["p.y"]) == [2.0, 2.5, 3.0, 3.5, 4.0]
    told = json.loads((tmp_path / "out" / "run.json").read_text())
    assert told["refresh"] is True
    assert told["coupling"]["refresh"]["refreshed"] == ["p"]
    assert "fmi2GetReal failed" in told["coupling"]["refresh"]["refused"]["shy"]
    assert "not that of shy, which refuses" in told["coupling"]["refresh"]["summary"]


def test_what_it_does_not_go_with_is_refused(mine, workspace):
    it = chain(mine, 2, algorithm="iterative")
    with pytest.raises(ScenarioError) as caught:
        check(it, workspace, "plain")
    assert "simulation.refresh is for" in str(caught.value)
    assert "with iterative what is exchanged agrees anyway; leave it out" in str(caught.value)
    it = chain(mine, 2)
    it.instances["p1"].step = 0.5
    with pytest.raises(ScenarioError) as caught:
        check(it, workspace, "plain")
    assert "p1 has a step of its own, with which refresh does not go" in str(caught.value)


def test_an_fmu_that_fails_after_it_was_willing_fails_the_run(mine):
    it = System(stop_time=1.0, step=0.25, algorithm="jacobi", refresh=True)
    it.add("ramp", mine("Course"), a=1.0, b=1.0)
    it.add("p", mine("Pass"), gain=1e308)
    it.connect("ramp.y", "p.u")
    with pytest.raises(FmuError) as caught:
        run(it, kind="native")
    assert "p, t = 1 s" in str(caught.value)
    assert caught.value.instance == "p"
