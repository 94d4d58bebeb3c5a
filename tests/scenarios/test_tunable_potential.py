"""The co-simulated laws of `docs/models/tunable_potential.md`: scenarios, Table 4, sampled exchange (section 8).

The laws are reconstructions; the numbers are the specification's own measurements with an independent implementation.
"""

import runpy
from pathlib import Path

import numpy as np
import pytest
from railcosim.components import CATALOGUE
from railcosim.fmus.build import native_problem
from railcosim.orchestrator import load, run
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.evaluation import BAD

LAWS = ("FixedDistanceCruise", "RangePotentialCruise", "TunablePotentialCruise")
helpers = runpy.run_path(str(Path(__file__).with_name("platoon_system.py")))
native = pytest.mark.skipif(bool(native_problem(CATALOGUE["Gust"])), reason="long runs need native FMUs")

# For each law: h, then deviation of speed (m/s), of gaps (m) and speed overshoot (m/s), Gauss-Seidel and Jacobi.
SAMPLING = {
    "FixedDistanceCruise": {
        0.05: ((0.07, 0.9, 9.69), (0.2, 2.8, 9.77)),
        0.1: ((0.14, 1.9, 9.73), (0.41, 5.6, 9.9)),
        0.5: ((0.7, 9.5, 10.1), (2.26, 31, 11.0)),
        1.0: ((1.46, 20, 10.5), (5.13, 68, 12.5)),
    },
    "TunablePotentialCruise": {
        0.05: ((0.04, 0.8, 6.92), (0.12, 2.3, 6.99)),
        0.1: ((0.08, 1.6, 6.95), (0.24, 4.8, 7.09)),
        0.5: ((0.4, 8.1, 7.24), (1.21, 26, 7.94)),
        1.0: ((0.81, 17, 7.6), (2.45, 55, 8.94)),
    },
    "RangePotentialCruise": {
        0.05: ((0.02, 0.4, 0.370), (0.07, 1.1, 0.372)),
        0.1: ((0.05, 0.7, 0.371), (0.15, 2.1, 0.374)),
        0.5: ((0.25, 3.6, 0.377), (0.79, 10.7, 0.392)),
        1.0: ((0.53, 7.1, 0.385), (1.79, 21.5, 0.412)),
    },
}
ALGORITHMS = ("gauss-seidel", "jacobi")


@pytest.fixture(scope="module")
def exact(platoon):
    """The continuous loops, every second."""
    return {name: platoon.dop853(law, report=1.0) for name, law in platoon.LAWS.items()}


# ---------------------------------------------------------------- shipped scenarios


@native
@pytest.mark.parametrize(
    ("scenario", "preset"),
    [
        ("tunable_potential", None),
        ("tunable_potential", "tunable-comfort"),
        pytest.param("cruise_comparison", None, marks=pytest.mark.long),
        pytest.param("gap_range", None, marks=pytest.mark.long),
    ],
)
def test_no_known_value_is_missed(scenario, preset):
    result = run(load(scenario, preset=preset))
    values = [*result.published, *result.references]
    assert [row.metric for row in values if row.verdict in BAD] == []
    assert sum(row.verdict == "reproduced" for row in values) >= 5
    assert {verdict.verdict for verdict in result.requirements} == {"pass"}


@native
@pytest.mark.parametrize(
    ("law", "convergence", "speed", "gap", "acceleration"),
    [
        ("FixedDistanceCruise", (405.0, 460.0), (9.60, 9.74), (272.0, 280.0), (2.864, 2.884)),
        ("RangePotentialCruise", (99.0, 101.0), (0.365, 0.375), (219.0, 220.5), (2.375, 2.379)),
        ("TunablePotentialCruise", (296.0, 302.0), (6.83, 6.97), (240.2, 247.8), (1.923, 1.943)),
    ],
)
def test_a_swap_alone_gives_each_row_of_table_4(law, convergence, speed, gap, acceleration):
    """Section 4, with its tolerances and what exchange every 0.05 s costs."""
    result = run(load("tunable_potential", swaps=[f"cruise={law}"], stop_time=2000.0))
    found = {metric.name: next(iter(metric.values.values())) for metric in result.metrics}
    assert convergence[0] <= found["convergence"] <= convergence[1]
    assert speed[0] <= found["speed_overshoot"] <= speed[1]
    assert gap[0] <= found["gap_overshoot"] <= gap[1]
    assert acceleration[0] <= found["acceleration_peak"] <= acceleration[1]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("scenario", ["comfort_cruise", "cruise_comparison"])
@pytest.mark.long
def test_a_swap_just_works(scenario, law):
    result = run(
        load(scenario, swaps=[f"cruise={law}"], stop_time=20.0, settings=["simulation.record=1"]), kind="plain"
    )
    assert result.status == "completed"
    models = {instance.model for name, instance in result.system.instances.items() if name.startswith("cruise")}
    assert models == {law}


@native
@pytest.mark.long
def test_the_table_shows_what_is_reconstructed(capfd, tmp_path, monkeypatch):
    """Measured beside published, under a heading that names the origin."""
    monkeypatch.setenv("COLUMNS", "200")
    assert call(["run", "cruise_comparison", "--no-figures", "-o", str(tmp_path)]) == 0
    text = capfd.readouterr().out
    assert "fitted: Huang et al. 2022, Table 4" in text
    assert "reconstructed" in text.splitlines()[0]
    for law in ("[17]", "[20]", "proposed"):
        assert f"{law}: convergence time (law and gains reconstructed to fit)" in " ".join(text.split())


@pytest.mark.parametrize(
    "name",
    [
        "tunable_potential",
        "cruise_comparison",
        "gap_range",
        "degraded_radio",
        "hilly_line",
        "braking_wave",
        "sinusoidal_leader",
        "virtual_coupling",
    ],
)
def test_the_label_stands_in_title_source_and_description(name):
    system = load(name)
    assert all(
        "econstructed" in text.lower()
        for text in (system.provenance.title, system.provenance.source, system.provenance.description)
    )


# ---------------------------------------------------------------- against the continuous loop


def cells(steps):
    """Cases of the table: law, step, algorithm, printed numbers."""
    return [
        pytest.param((law, h, algorithm, printed), id=f"{law}-{h}-{algorithm}")
        for law, rows in SAMPLING.items()
        for h in steps
        for algorithm, printed in zip(ALGORITHMS, rows[h], strict=True)
    ]


def check_sampling(platoon, exact, case):
    law, h, algorithm, expected = case
    found = helpers["deviation"](platoon, law, exact[law], step=h, algorithm=algorithm)
    for value, printed in zip(found, expected, strict=True):
        digits = len(repr(printed).partition(".")[2]) if isinstance(printed, float) else 0
        assert value == pytest.approx(printed, rel=0.02, abs=0.75 * 10.0**-digits)


@native
@pytest.mark.parametrize("case", cells((0.5, 1.0)))
def test_sampled_exchange(platoon, exact, case):
    """The table of section 8: deviations of speed and gap from the continuous loop, and the overshoot."""
    check_sampling(platoon, exact, case)


@native
@pytest.mark.long
@pytest.mark.parametrize("case", cells((0.05, 0.1)))
def test_sampled_exchange_at_short_steps(platoon, exact, case):
    check_sampling(platoon, exact, case)


@native
@pytest.mark.long
@pytest.mark.parametrize(
    ("law", "h", "algorithm", "converges"),
    [
        ("FixedDistanceCruise", 3.0, "jacobi", False),
        ("TunablePotentialCruise", 4.0, "jacobi", False),
        ("FixedDistanceCruise", 6.0, "gauss-seidel", True),
        ("TunablePotentialCruise", 6.0, "gauss-seidel", True),
    ],
)
def test_how_long_a_step_may_be(platoon, law, h, algorithm, converges):
    """Section 8: the delay eats the relative damping."""
    system = helpers["platoon_system"](platoon, law, step=h, stop=1992.0, algorithm=algorithm)
    _, v, _ = helpers["trajectories"](run(system))
    assert bool(np.abs(v[-20:] - 70.0).max() <= 1.0) is converges


@pytest.mark.long
def test_halving_the_step_halves_the_difference(platoon):
    """First order in the exchange; over the first 200 s, where no dead zone has let the gaps rest."""
    exact = platoon.dop853(platoon.FIXED, stop=200.0, report=1.0)
    found = []
    for h in (1.0, 0.5):
        system = helpers["platoon_system"](platoon, "FixedDistanceCruise", step=h, stop=200.0, record=1.0)
        _, v, _ = helpers["trajectories"](run(system, kind="plain"))
        found.append(np.abs(v - exact.v).max())
    assert found[0] / found[1] == pytest.approx(2.0, abs=0.15)


# ---------------------------------------------------------------- out of the range


def test_a_start_outside_the_range_raises_the_flag(platoon):
    """Section 9, 6: the range law needs all gaps strictly inside; a start at 6.4 km is not."""
    system = helpers["platoon_system"](platoon, "RangePotentialCruise", step=0.1, stop=5.0)
    system.instances["train[5]"].start["position"] = 28.9e3
    result = run(system, kind="plain")
    assert result["cruise[5].range_violated"][0] == 1.0
    assert result["cruise[4].range_violated"][0] == 1.0
    assert result["cruise[2].range_violated"].max() == 0.0


@native
def test_a_limit_takes_the_range_laws_guarantee(platoon):
    """A start inside that leaves under a hard limit: gap 4-5 of 6.55 km, train 5 twenty metres a second too fast."""
    gaps = {}
    for limit in (0.0, 0.2):
        system = helpers["platoon_system"](
            platoon, "RangePotentialCruise", step=0.05, stop=200.0, acceleration_limit=limit
        )
        system.instances["train[5]"].start.update(position=35.3e3 - 6.7e3, speed=70.0)
        result = run(system)
        x, _, _ = helpers["trajectories"](result)
        gaps[limit] = (x[:, 3] - x[:, 4]).min()
        assert bool(result["cruise[5].range_violated"].any()) is (limit > 0.0)
    assert gaps[0.0] > 6.5e3 > gaps[0.2]
