"""Textbook cases with known answers, for every master algorithm: two masses, a stiff coupling, a loop, a bouncing ball.

Theory and exact solutions are in `textbook.py`, the components in `textbook_components.py`.
"""

import itertools
import json
import re
import runpy
from pathlib import Path

import numpy as np
import pytest
from railcosim.orchestrator.errors import CouplingError, FmuError
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System

HERE = Path(__file__).parent
theory = runpy.run_path(str(HERE / "textbook.py"))
COMPONENTS = str(HERE / "textbook_components.py")
OSCILLATOR, STIFF, Coupled = theory["OSCILLATOR"], theory["STIFF"], theory["Coupled"]
ALGORITHMS = ("jacobi", "gauss-seidel", "iterative")
EACH = pytest.mark.parametrize("order", [0, 1, 2])
BY_ALL = pytest.mark.parametrize("algorithm", ALGORITHMS)


def masses(step, algorithm, order=0, *, of=OSCILLATOR, start=(1.0, 0.0, 0.0, 0.0), stop=5.0, fine=0.0125, **how):
    """Two masses coupled by force and displacement; ``fine`` is the longest step of the integration inside."""
    m1, k1, d1, m2, k2, d2, kc, dc = of.values()
    it = System(stop_time=stop, step=step, algorithm=algorithm, extrapolation=order, **how)
    left = {"mass": m1, "stiffness": k1, "damping": d1, "x": start[0], "v": start[1], "max_step": fine}
    right = {"mass": m2, "stiffness": k2, "damping": d2, "x": start[2], "v": start[3], "max_step": fine}
    it.add("left", f"{COMPONENTS}:Left", **left)
    it.add("right", f"{COMPONENTS}:Right", coupling=kc, coupling_damping=dc, **right)
    it.connect("right.force", "left.force")
    it.connect("left.x", "right.other_x")
    it.connect("left.v", "right.other_v")
    return it


def off(result, of=OSCILLATOR, start=(1.0, 0.0, 0.0, 0.0), every=1):
    """The largest deviation of a displacement from the exact one, m."""
    exact = theory["motion"](result.time[::every], start, of)
    found = np.array([result["left.x"], result["right.x"]]).T[::every]
    return float(np.abs(found - exact[:, [0, 2]]).max())


def orders(errors):
    """The measured order of convergence between each step and its half."""
    return [float(np.log2(a / b)) for a, b in itertools.pairwise(errors)]


# -------------------------------------------------------------------- two masses


@EACH
@BY_ALL
def test_each_algorithm_does_what_its_equations_say(algorithm, order):
    """The whole run, its first steps with fewer points included, is the linear map by matrix exponentials."""
    how = {"tolerance": 1e-12} if algorithm == "iterative" else {}
    result = run(masses(0.2, algorithm, order, stop=4.0, fine=0.005, **how), kind="native")
    expected = Coupled(0.2, algorithm, order).run((1.0, 0.0, 0.0, 0.0), 20)
    for column, name in enumerate(["left.x", "left.v", "right.x", "right.v"]):
        assert np.abs(result[name] - expected[:, column]).max() < 1e-8, name


@EACH
@BY_ALL
def test_order_of_convergence(algorithm, order):
    """A polynomial of order n through former inputs leaves an error of order n + 1 in the step.

    Without a damper between the masses: then the slope of what is exchanged is nought at the start, where no algorithm
    but `iterative` knows it yet.
    """
    of = OSCILLATOR | {"dc": 0.0}
    errors = [off(run(masses(h, algorithm, order, of=of), kind="native"), of) for h in (0.05, 0.025, 0.0125)]
    first, second = orders(errors)
    assert first == pytest.approx(order + 1, abs=0.2)
    assert second == pytest.approx(order + 1, abs=0.1)
    assert errors[0] < (0.3, 0.02, 0.003)[order]


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_a_start_of_which_no_slope_is_known_costs_the_third_order(algorithm):
    """The first step holds its inputs: an error of second order, once, which the run cannot get below."""
    steps = (0.05, 0.025, 0.0125, 0.00625)
    explicit = orders([off(run(masses(h, algorithm, 2, stop=2.0), kind="native")) for h in steps])
    assert explicit[0] > explicit[1] > explicit[2]
    assert explicit[2] == pytest.approx(2.0, abs=0.25)
    implicit = orders([off(run(masses(h, "iterative", 2, stop=2.0), kind="native")) for h in steps[:3]])
    assert implicit == pytest.approx([3.0, 3.0], abs=0.1)


@pytest.mark.parametrize("acceleration", ["none", "aitken"])
def test_the_way_of_iterating_does_not_change_the_answer(acceleration):
    reference = run(masses(0.1, "iterative", 1, tolerance=1e-10), kind="native")
    other = run(masses(0.1, "iterative", 1, tolerance=1e-10, acceleration=acceleration), kind="native")
    assert np.abs(reference["left.x"] - other["left.x"]).max() < 1e-8
    assert other.coupling["iterative"]["most_iterations"] <= 6


@pytest.mark.parametrize(
    ("algorithm", "kind"), [("jacobi", "python"), ("gauss-seidel", "plain"), ("iterative", "plain")]
)
def test_all_kinds_agree(algorithm, kind):
    native = run(masses(0.1, algorithm, stop=2.0, fine=0.05), kind="native")
    other = run(masses(0.1, algorithm, stop=2.0, fine=0.05), kind=kind)
    assert np.array_equal(native.time, other.time)
    for name in native.names():
        assert np.abs(native[name] - other[name]).max() < 1e-12, name


@pytest.mark.parametrize(
    ("algorithm", "order"),
    [("jacobi", 0), ("gauss-seidel", 0), ("gauss-seidel", 1), ("iterative", 0), ("iterative", 1)],
)
def test_stability_limit(algorithm, order):
    """The oscillation decays just below the step at which the linear map's spectral radius is 1, and grows above."""
    edge = theory["limit"](algorithm, order)
    for part, grows in ((0.97, False), (1.03, True)):
        h = part * edge
        coupled = Coupled(h, algorithm, order)
        factor, start = coupled.radius(), coupled.slowest()
        assert (factor > 1.0) == grows
        half = int(min(300.0, 5.0 / abs(np.log(factor))))
        theirs = np.abs(coupled.run(start, 2 * half)[:, 0])
        it = masses(h, algorithm, order, start=start, stop=2.0 * half * h, fine=h / 30.0)
        found = np.abs(run(it, kind="native")["left.x"])
        # An oscillation at these steps is seen at a few points only: its peaks are compared with those of the theory.
        seen = [size[half + half // 2 :].max() / size[half // 2 : half + 1].max() for size in (found, theirs)]
        assert (seen[0] > 1.0) == grows
        assert seen[0] == pytest.approx(seen[1], rel=1e-3)


@pytest.mark.long
def test_the_table_of_the_documentation_is_that_of_the_theory():
    """Errors at two steps, and the limits of both systems; in docs/algorithms.md to two or three digits."""
    page = (HERE.parents[1] / "docs" / "algorithms.md").read_text(encoding="utf-8")
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in page.splitlines()]
    told = {(row[0].strip('`"'), int(row[1])): row[3:] for row in rows if len(row) == 7 and row[1].isdigit()}
    assert list(told) == [(algorithm, order) for algorithm in ALGORITHMS for order in (0, 1, 2)]
    for case, (*errors, light, heavy) in told.items():
        for h, error in zip((0.1, 0.05), errors, strict=True):
            found = Coupled(h, *case).run((1.0, 0.0, 0.0, 0.0), round(10.0 / h))
            exact = theory["motion"](h * np.arange(len(found)))
            assert error == f"{float(f'{1e3 * np.abs(found - exact)[:, ::2].max():.2g}'):g} mm"
        assert light == f"{theory['limit'](*case):.3g} s"
        edge = theory["limit"](*case, STIFF)
        assert heavy == ("none" if np.isinf(edge) else f"{edge:.2g} s")


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
@pytest.mark.parametrize("slow", ["left", "right"])
@pytest.mark.parametrize(("order", "expected"), [(0, 1.0), (1, 2.0)])
def test_order_with_one_mass_stepping_four_times_as_long(algorithm, slow, order, expected):
    """A value belongs to the time that its instance has reached, whoever asks for it in between."""
    errors = []
    for h in (0.025, 0.0125):
        it = masses(h, algorithm, order, stop=2.0)
        it.instances[slow].step = 4.0 * h
        errors.append(off(run(it, kind="native"), every=4))
    assert orders(errors)[0] == pytest.approx(expected, abs=0.15)


@pytest.mark.parametrize(("order", "slope"), [(0, 1 / 2), (1, 2 / 3), (2, 3 / 4)])
def test_adaptive_error_follows_the_tolerance(order, slope):
    """It bounds the error of a step, of order p + 1 = n + 2: that of the run goes as tolerance^(p / (p + 1))."""
    found = [run(masses(1.0, "adaptive", order, tolerance=t), kind="native") for t in (1e-3, 1e-5)]
    coarse, fine = map(off, found)
    assert coarse < 0.05
    assert np.log10(coarse / fine) / 2.0 == pytest.approx(slope, abs=0.12)
    # The number of steps grows as tolerance^(-1 / (p + 1)): fewer by far where inputs are continued.
    assert np.log10(len(found[1].time) / len(found[0].time)) / 2.0 == pytest.approx(1.0 / (order + 2), abs=0.07)


def test_a_platoon_of_trains_gains_an_order_by_extrapolation(reference):
    """Speeds against the continuous loop in SciPy; the controllers are continuous laws here. The page has them."""
    case = runpy.run_path(str(HERE / "comfort_system.py"))
    errors = {}
    for algorithm, order in (("gauss-seidel", 0), ("gauss-seidel", 1), ("iterative", 1)):
        for h in (2.0, 1.0):
            it = case["comfort_system"](reference, step=h, stop=60.0, algorithm=algorithm)
            it.stepping.extrapolation = order
            result = run(it, kind="native")
            speeds = np.column_stack([result[f"train[{i}].speed"] for i in range(1, 5)])
            errors[algorithm, order, h] = np.abs(speeds - reference.closed_loop(stop=60.0, interval=h).v).max()
        coarse, fine = errors[algorithm, order, 2.0], errors[algorithm, order, 1.0]
        assert np.log2(coarse / fine) == pytest.approx(order + 1, abs=0.1)
    told = {("gauss-seidel", 0): 0.22, ("gauss-seidel", 1): 0.033, ("iterative", 1): 0.0041}
    for how, error in told.items():
        assert errors[*how, 1.0] == pytest.approx(error, rel=0.05)


# -------------------------------------------------------------------- a stiff coupling


AT_REST = (1.0, 0.0, 1.0, 0.0)


def stiff(algorithm, order=0, step=0.05, stop=40.0, **how):
    return masses(step, algorithm, order, of=STIFF, start=AT_REST, stop=stop, fine=0.0025, **how)


def factor_in(text):
    """The growth in each step that a message tells."""
    return float(re.search(r"grows by a factor of (\S+) per communication step", text)[1])


def test_jacobi_loses_a_stiff_coupling_and_says_so(tmp_path):
    """It runs to the end with numbers that nothing in the world has."""
    outcome = run(stiff("jacobi"), kind="native", output=tmp_path)
    assert np.abs(outcome["left.x"]).max() > 1e200
    (note,) = [finding.message for finding in outcome.findings]
    factor = Coupled(0.05, "jacobi", of=STIFF).radius()
    assert note.startswith("the coupling through right.force, left.x, left.v diverges: it grows by a factor of ")
    assert factor_in(note) == pytest.approx(factor, rel=0.01)
    assert 'take a smaller step, or algorithm = "iterative" with extrapolation = 1' in note
    record = json.loads((tmp_path / "run.json").read_text())
    assert [(finding["kind"], finding["message"]) for finding in record["findings"]] == [("diverging", note)]


def test_gauss_seidel_loses_it_faster_and_the_error_says_why():
    """A value is no number any more, and the blame does not stay with the FMU that computed it."""
    with pytest.raises(FmuError) as caught:
        run(stiff("gauss-seidel"), kind="native")
    text = str(caught.value)
    factor = Coupled(0.05, "gauss-seidel", of=STIFF).radius()
    assert "fmi2DoStep failed; the coupling through right.force, left.x, left.v diverges" in text
    assert factor_in(text) == pytest.approx(factor, rel=0.01)
    assert caught.value.run.notes == []


@pytest.mark.parametrize("acceleration", ["aitken", "anderson"])
def test_iterative_holds_it(acceleration):
    """With inputs that move over the step: of second order, and stable at any step."""
    found = [run(stiff("iterative", 1, h, 10.0, acceleration=acceleration), kind="native") for h in (0.05, 0.025)]
    errors = [off(one, STIFF, AT_REST) for one in found]
    assert errors[0] < 0.006
    assert orders(errors)[0] == pytest.approx(2.0, abs=0.1)
    assert [one.coupling["iterative"]["most_iterations"] for one in found] <= [4, 4]
    assert found[0].coupling["iterative"]["worst_residual_per_tolerance"] <= 1.0
    assert found[0].notes == []


def test_plain_iteration_diverges_where_it_does_not_contract_and_says_so():
    factor = Coupled(0.05, "iterative", 1, STIFF).contraction()
    assert factor == pytest.approx(-2.19, abs=0.01)
    with pytest.raises(CouplingError) as caught:
        run(stiff("iterative", 1, acceleration="none"), kind="native")
    text = str(caught.value)
    assert text.startswith("t = 0 s: the coupling through ")
    assert set(re.search("through (.*) diverges", text)[1].split(", ")) == {"right.force", "left.x", "left.v"}
    assert "iterations of the step of 0.05 s they still disagree by " in text
    assert 'take a smaller step, simulation.acceleration = "anderson" or a smaller simulation.relaxation' in text


def test_relaxation_makes_plain_iteration_contract():
    """Of the way to the new values a part w changes the distance by 1 - w (1 + 2.19): 0.04 with w = 0.3."""
    relaxed = run(stiff("iterative", 1, stop=5.0, acceleration="none", relaxation=0.3), kind="native")
    best = run(stiff("iterative", 1, stop=5.0), kind="native")
    assert np.abs(relaxed["left.x"] - best["left.x"]).max() < 1e-6
    # from about 1 to 1e-8 at 1.4 decades an iteration
    assert 5 <= relaxed.coupling["iterative"]["most_iterations"] <= 8


def test_iteration_that_is_given_too_few_attempts_says_what_to_raise():
    with pytest.raises(CouplingError, match=r"does not converge: after 3 iterations.*more simulation\.max_iterations"):
        run(stiff("iterative", 1, acceleration="none", relaxation=0.3, max_iterations=3), kind="native")


# -------------------------------------------------------------------- an algebraic loop


def pair(swing=0.0, **how):
    """2 x1^2 + 5 x2 = 42 - swing sin(t), x1 - 6 x2 = 4."""
    it = System(**{"stop_time": 2.0, "step": 0.1, "algebraic_loops": "solve"} | how)
    it.add("parabola", f"{COMPONENTS}:Parabola", swing=swing)
    it.add("line", f"{COMPONENTS}:Line")
    it.connect("parabola.x2", "line.x2")
    it.connect("line.x1", "parabola.x1")
    return it


@BY_ALL
@pytest.mark.parametrize("kind", ["native", "python", "plain"])
def test_a_loop_is_solved_at_each_point(algorithm, kind):
    """By directional derivatives of native FMUs, by finite differences of the others."""
    result = run(pair(swing=30.0, algorithm=algorithm), kind=kind)
    exact = theory["root"](result.time, 30.0)
    assert exact[0] == pytest.approx(4.5571749758, abs=1e-10)
    assert np.abs(result["line.x1"] - exact).max() < 1e-9
    assert np.abs(result["parabola.x2"] - (exact - 4.0) / 6.0).max() < 1e-9
    told = result.coupling["algebraic_loop"]
    assert told["signals"] == ["parabola.x2", "line.x1"]
    assert told["solutions"] == 20 or algorithm == "iterative"  # which leaves little to be solved
    assert told["worst_residual"] < 1e-9


def test_the_iterations_solve_a_loop_to_their_tolerance():
    result = run(pair(swing=30.0, algorithm="iterative", algebraic_loops="delay"), kind="native")
    assert np.abs(result["line.x1"] - theory["root"](result.time, 30.0)).max() < 1e-7


@pytest.mark.parametrize("kind", ["native", "plain"])
@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_a_loop_that_is_delayed_diverges_and_says_so(algorithm, kind):
    """The slope around it is -22; then the square takes over."""
    with pytest.raises(FmuError) as caught:
        run(pair(swing=30.0, algorithm=algorithm, algebraic_loops="delay"), kind=kind)
    text = str(caught.value)
    assert caught.value.run["line.x1"][0] == pytest.approx(4.5571749758, abs=1e-9)
    assert "the coupling through parabola.x2, line.x1 diverges: it grows more than a thousandfold" in text
    assert 'solved at each communication point by algebraic_loops = "solve"' in text


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_a_loop_that_loses_its_solution_says_so(algorithm):
    """Without one from 8 (60 sin t - 45.3) > 25 / 36 on: t = 0.87 s."""
    with pytest.raises(CouplingError) as caught:
        run(pair(swing=60.0, algorithm=algorithm), kind="native")
    text = str(caught.value)
    assert text.startswith("t = 0.9 s: the algebraic loop through parabola.x2, line.x1 has no solution near its last")
    assert "relative residual" in text
    assert "put a component with memory into it" in text
    assert caught.value.run.time[-1] == pytest.approx(0.8)


# -------------------------------------------------------------------- a ball that bounces


def ball(algorithm="adaptive", order=1, step=0.1, stop=1.6, **how):
    it = System(stop_time=stop, step=step, algorithm=algorithm, extrapolation=order, **how)
    it.add("ball", f"{COMPONENTS}:Ball", height=1.0, max_step=0.002)
    it.add("ground", f"{COMPONENTS}:Ground", stiffness=1e4, damping=20.0)
    it.connect("ground.force", "ball.force")
    it.connect("ball.height", "ground.height")
    it.connect("ball.speed", "ground.speed")
    return it


def bounced(result):
    """Times of the first two impacts and heights of their rebounds, from points in free flight between them."""
    exact, g = theory["bounces"](3), 9.81
    found = []
    for k in (0, 1):
        before = np.searchsorted(result.time, exact[k, 0] - 0.02) - 1
        after = np.searchsorted(result.time, 0.5 * (exact[k, 0] + exact[k + 1, 0])) - 1
        height, speed = result["ball.height"], result["ball.speed"]
        fall = (speed[before] + np.sqrt(speed[before] ** 2 + 2.0 * g * height[before])) / g
        found.append((result.time[before] + fall, height[after] + speed[after] ** 2 / (2.0 * g)))
    return np.abs(np.array(found) - exact[:2])


@pytest.mark.parametrize("order", [0, 1])
def test_a_bounce_is_as_exact_as_the_tolerance_asks(order):
    """Impact and rebound against free fall and a damped half-oscillation; steps of 0.1 s in flight, none beside it.

    The force jumps at the impact (the damper), so that no more than the order of the held input is left.
    """
    runs = {tolerance: run(ball(order=order, tolerance=tolerance), kind="native") for tolerance in (1e-3, 1e-4, 1e-5)}
    errors = [bounced(result).max(axis=0) for result in runs.values()]
    heights = [error[1] for error in errors]
    assert heights[0] < 0.05
    for coarse, fine in ((0, 1), (1, 2)):
        assert 2.0 < heights[coarse] / heights[fine] < 10.0
    for result in runs.values():
        told = result.coupling["adaptive"]
        assert told["accepted"] == len(result.time) - 1
        assert told["rejected"] > 10
        assert told["longest_step"] == pytest.approx(0.1)
        assert told["shortest_step"] < 0.01


def test_a_bounce_takes_far_fewer_steps_than_a_fixed_step():
    """0.12 % of the rebound's height: 113 steps against 16 000 of 0.1 ms, which are less exact."""
    adaptive, fixed = run(ball(tolerance=1e-4), kind="native"), run(ball("gauss-seidel", 0, 1e-4), kind="native")
    assert len(adaptive.time) < 150
    assert bounced(adaptive)[:, 1].max() < 1e-3 < bounced(fixed)[:, 1].max()
    assert bounced(adaptive)[:, 0].max() < 1e-3


@pytest.mark.parametrize("step", [0.05, 0.0731, 0.1, 0.15])
def test_an_impact_in_the_last_half_of_a_step_is_not_missed(step):
    """Neither the whole step nor its halves look at its end; the ball would go deep into the ground for nothing."""
    result = run(ball(order=0, step=step, tolerance=1e-3), kind="native")
    assert result["ball.height"].min() > -0.06  # it goes 44 mm deep
    assert bounced(result)[:, 1].max() < 0.05


def test_tolerances_of_single_signals_count():
    loose = run(ball(tolerance=1e-3), kind="native")
    looser = run(ball(tolerance=1e-3, tolerances={"ball.speed": [0.0, 1.0]}), kind="native")
    tight = run(ball(tolerance=1.0, tolerances={"ball.height": [0.0, 1e-7], "ball.speed": [0.0, 1e-4]}), kind="native")
    assert len(looser.time) < 0.6 * len(loose.time) < 0.6 * 0.6 * len(tight.time)
    assert bounced(tight)[:, 1].max() < 0.2 * bounced(loose)[:, 1].max() < 0.04 * bounced(looser)[:, 1].max()


def test_rows_come_where_they_are_asked_for():
    """Each accepted step, or an even grid, on which the error is no larger."""
    free = run(ball(tolerance=1e-4), kind="native")
    grid = run(ball(tolerance=1e-4, record=0.04), kind="native")
    assert np.ptp(np.diff(free.time)) > 0.09
    assert grid.time == pytest.approx(np.arange(41) * 0.04, abs=1e-15)
    assert grid.time[-1] == 1.6
    assert grid.coupling["adaptive"]["accepted"] > len(grid.time)
    assert bounced(grid)[:, 1].max() < 2e-3
