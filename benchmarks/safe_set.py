"""Which starts keep the range of gaps: the safe set of the comfort-aware cruise law, as a figure.

The nominal case of Wang et al. 2020 (figure-consistent gains, both layers, no gust) with another gap between trains 3
and 4 and another speed of train 4 at the start; every point is a co-simulation of 350 s. Beside it the condition that
any law with |a| <= a_max must meet, speed difference^2 / (4 a_max) <= distance to the bound: necessary, not sufficient.

    python benchmarks/safe_set.py docs/images/safe_set.png
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from railcosim.orchestrator import load, run

LOW, HIGH, LIMIT = 15e3, 20e3, 1.0


def excursion(gap: float, speed: float) -> float:
    """How far the gaps come within the range (m): negative outside."""
    changes = [f"train[4].position={18e3 - gap}", f"train[4].speed={speed}", "simulation.record=0.5"]
    result = run(load("comfort_cruise", preset="no-gust", settings=changes))
    position = np.array([result[f"train[{i}].position"] for i in range(1, 5)])
    gaps = position[:-1] - position[1:]
    return float(min((gaps - LOW).min(), (HIGH - gaps).min()))


def draw(gaps: np.ndarray, speeds: np.ndarray, margins: np.ndarray, path: Path) -> None:
    figure = Figure(figsize=(7.5, 4.8), dpi=100, layout="constrained")
    ax = figure.add_subplot()
    filled = ax.contourf(
        gaps / 1e3,
        speeds,
        margins / 1e3,
        levels=np.arange(-2.0, 2.01, 0.5),
        cmap="RdBu",
        vmin=-2.0,
        vmax=2.0,
        extend="both",
    )
    ax.contour(gaps / 1e3, speeds, margins, levels=[0.0], colors="black", linewidths=1.8)
    slower = np.maximum(65.0 - speeds, 0.0) ** 2 / (4.0 * LIMIT)
    faster = np.maximum(speeds - 65.0, 0.0) ** 2 / (4.0 * LIMIT)
    ax.plot((HIGH - slower) / 1e3, speeds, "k--", linewidth=1.2, label="necessary condition")
    ax.plot((LOW + faster) / 1e3, speeds, "k--", linewidth=1.2)
    ax.plot(17.0, 5.0, "ko", label="published start")
    ax.plot(19.0, 5.0, "kx", label="counterexample")
    ax.set(xlabel="gap of trains 3 and 4 at the start [km]", ylabel="speed of train 4 at the start [m/s]")
    ax.set_xlim(gaps[0] / 1e3, gaps[-1] / 1e3)
    ax.set_title("Safe set of the comfort-aware law (blue: all gaps stay in 15 to 20 km)", loc="left", fontsize=10)
    ax.legend(loc="lower left", fontsize=8)
    figure.colorbar(filled, label="smallest distance to a bound within 350 s [km]")
    figure.savefig(path, metadata={"Software": None})


def main() -> None:
    points = int(sys.argv[2]) if len(sys.argv) > 2 else 25
    gaps, speeds = np.linspace(15.1e3, 19.9e3, points), np.linspace(0.0, 100.0, points)
    margins = np.array([[excursion(gap, speed) for gap in gaps] for speed in speeds])
    draw(gaps, speeds, margins, Path(sys.argv[1]))
    print(f"{(margins > 0.0).sum()} of {margins.size} starts keep the range")


if __name__ == "__main__":
    main()
