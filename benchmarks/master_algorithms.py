"""Accuracy and stability of the master algorithms on two masses: the table and the figure of docs/algorithms.md.

    python benchmarks/master_algorithms.py --figure docs/images/algorithms.png

Theory and components are those of tests/scenarios/test_textbook.py.
"""

import argparse
import runpy
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from railcosim.orchestrator import System, run

PLACE = Path(__file__).parents[1] / "tests" / "scenarios"
theory = runpy.run_path(str(PLACE / "textbook.py"))
COMPONENTS = PLACE / "textbook_components.py"
STYLES = {"jacobi": "C3", "gauss-seidel": "C0", "iterative": "C2", "adaptive": "C1"}
LINES = {0: "-", 1: "--", 2: ":"}
CASES = [(algorithm, order) for algorithm in ("jacobi", "gauss-seidel", "iterative") for order in (0, 1, 2)]


def masses(step, algorithm, order, **how):
    """The oscillator of the tests for 10 s."""
    m1, k1, d1, m2, k2, d2, kc, dc = theory["OSCILLATOR"].values()
    it = System(stop_time=10.0, step=step, algorithm=algorithm, extrapolation=order, **how)
    it.add("left", f"{COMPONENTS}:Left", mass=m1, stiffness=k1, damping=d1, max_step=0.01)
    right = {"mass": m2, "stiffness": k2, "damping": d2, "coupling": kc, "coupling_damping": dc}
    it.add("right", f"{COMPONENTS}:Right", **right, max_step=0.01)
    it.connect("right.force", "left.force")
    it.connect("left.x", "right.other_x")
    it.connect("left.v", "right.other_v")
    return run(it, kind="native")


def off(result):
    """The largest deviation from the exact displacements, m."""
    exact = theory["motion"](result.time)
    return float(np.abs(np.array([result["left.x"], result["right.x"]]).T - exact[:, [0, 2]]).max())


def stepping(result):
    """doStep calls of each FMU in all."""
    told = result.coupling
    if "adaptive" in told:  # a whole step, two halves, and one with the inputs of the end if it is accepted
        return 4 * told["adaptive"]["accepted"] + 3 * told["adaptive"]["rejected"]
    steps = len(result.time) - 1
    return steps * told["iterative"]["iterations_per_step"] if "iterative" in told else steps


def table():
    print("| algorithm | extrapolation | doStep calls | error at 0.1 s | at 0.05 s | limit, light | stiff |")
    for algorithm, order in CASES:
        coarse, fine = masses(0.1, algorithm, order), masses(0.05, algorithm, order)
        light, stiff = (theory["limit"](algorithm, order, theory[name]) for name in ("OSCILLATOR", "STIFF"))
        calls = stepping(fine) / (len(fine.time) - 1)
        errors = " | ".join(f"{float(f'{1e3 * off(one):.2g}'):g} mm" for one in (coarse, fine))
        limits = f"{light:.3g} s | {'none' if np.isinf(stiff) else f'{stiff:.2g} s'}"
        print(f'| `"{algorithm}"` | {order} | {calls:.2g} | {errors} | {limits} |')
    for order in (0, 1, 2):
        for tolerance in (1e-3, 1e-4, 1e-5):
            found = masses(1.0, "adaptive", order, tolerance=tolerance)
            count = found.coupling["adaptive"]["accepted"]
            print(f"adaptive, extrapolation {order}, {tolerance:g}: {count} steps, error {1e3 * off(found):.2g} mm")


def draw(path):
    figure = Figure(figsize=(8.5, 3.6), dpi=100, layout="constrained")
    errors, growth = figure.subplots(1, 2)
    for algorithm, order in CASES:
        found = [masses(h, algorithm, order) for h in (0.2, 0.1, 0.05, 0.025, 0.0125)]
        place = [stepping(one) for one in found], [off(one) for one in found]
        errors.loglog(*place, STYLES[algorithm] + LINES[order], marker=".", markersize=4)
    for order in (0, 1, 2):
        found = [masses(1.0, "adaptive", order, tolerance=t) for t in (1e-2, 1e-3, 1e-4, 1e-5)]
        place = [stepping(one) for one in found], [off(one) for one in found]
        errors.loglog(*place, STYLES["adaptive"] + LINES[order], marker=".", markersize=4)
    errors.set(
        xlabel="doStep calls of each FMU in 10 s", ylabel="largest error [m]", title="two masses: work and error"
    )
    steps = np.geomspace(1e-3, 0.3, 120)
    for algorithm, order in CASES:
        factors = [theory["Coupled"](h, algorithm, order, theory["STIFF"]).radius() for h in steps]
        growth.semilogx(steps, factors, STYLES[algorithm] + LINES[order])
    growth.axhline(1.0, color="0.6", linewidth=0.8)
    growth.set(xlabel="communication step [s]", ylabel="growth in each step", ylim=(0.9, 2.0), title="stiff coupling")
    for axes in (errors, growth):
        axes.grid(alpha=0.3)
    handles = [errors.plot([], [], color, label=name)[0] for name, color in STYLES.items()]
    handles += [errors.plot([], [], "k" + line, label=f"extrapolation {n}")[0] for n, line in LINES.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=7, fontsize=8, frameon=False, columnspacing=1.2)
    figure.savefig(path, metadata={"Software": None})


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--figure", help="where to draw the figure; without it the table is printed")
    given = parser.parse_args()
    if given.figure:
        draw(given.figure)
    else:
        table()


if __name__ == "__main__":
    main()
