"""The optimum beside a published one, and what it keeps, found from its profile without our code."""

import csv

import numpy as np
import pytest
from railcosim.components.environment.profile import Profile
from railcosim.orchestrator.driving import load_case, optimise, profile_of, write_profile
from railcosim.orchestrator.errors import ScenarioError
from scipy.integrate import solve_ivp, trapezoid

PUBLISHED = 440.1406
"""kWh, by GPOPS-II."""


@pytest.fixture(scope="module")
def virm():
    return optimise(load_case("virm6_limit_100"))


def test_the_published_optimum(virm):
    assert virm.solution.energy / 3.6e6 == pytest.approx(PUBLISHED, rel=1e-4)
    assert virm.solution.time == pytest.approx(1541.0, abs=1e-3)
    assert virm.solution.feasibility < 1e-6
    assert virm.solution.optimality < 1e-6
    assert virm.mesh_error < 1e-4
    assert virm.change < 1e-5
    assert virm.meshes == sorted(set(virm.meshes))


def test_the_profile_is_a_driving_of_the_published_train(virm, tmp_path):
    with write_profile(tmp_path / "new", virm.solution).open(newline="") as stream:
        header, *rows = csv.reader(stream)
    assert header == ["position", "time", "speed", "traction_force", "braking_force"]
    x, t, v, traction, brake = np.array(rows, dtype=float).T
    assert (x[0], x[-1], t[0]) == (0.0, 48531.0, 0.0)
    assert (np.diff(x) > 0.0).all()
    assert (np.diff(t) > 0.0).all()
    limit = np.where((x > 25000.0) & (x <= 35000.0), 100.0, 140.0) / 3.6
    assert (v <= limit + 1e-6).all()
    for force in (traction, brake):
        assert force.min() >= 0.0
        assert force.max() <= 213900.0 + 1e-2
        assert (force * v).max() <= 3129277.0 * (1.0 + 1e-6)
    inertia = 391e3 * 1.06

    def over_place(place, state):
        speed = np.sqrt(2.0 * state[0])
        force = np.interp(place, x, traction) - np.interp(place, x, brake)
        return [(force - 5854.0 - 74.16 * speed - 12.96 * speed**2) / inertia, 1.0 / speed]

    run = solve_ivp(over_place, (0.0, x[-1]), [0.5 * v[0] ** 2, 0.0], rtol=1e-8, atol=1e-8, max_step=50.0, t_eval=x)
    assert np.sqrt(2.0 * run.y[0]) == pytest.approx(v, abs=0.05)  # forces between rows are straight lines here
    assert run.y[1] == pytest.approx(t, abs=0.1)
    assert 2.0 * np.diff(x) / (v[1:] + v[:-1]) == pytest.approx(np.diff(t), abs=6e-3)
    energy = trapezoid(traction / 0.73 - 0.73 * brake, x) / 3.6e6
    assert energy == pytest.approx(virm.solution.energy / 3.6e6, rel=1e-4)
    assert trapezoid(1.0 / v, x) == pytest.approx(1541.0, abs=1.0)
    resistance = 5854.0 + 74.16 * v + 12.96 * v**2
    assert trapezoid(traction - brake - resistance, x) == pytest.approx(
        0.5 * inertia * (v[-1] ** 2 - v[0] ** 2), abs=2e5
    )


def test_near_a_standstill_rows_are_where_scipy_gets_to_over_time(virm):
    """The force is the largest there is, 213.9 kN, up to 14.6 m/s, which are reached after some 200 m."""
    x, t, v, traction, brake = profile_of(virm.solution)
    x, t, v, net = (column[x < 200.0] for column in (x, t, v, traction - brake))
    assert len(x) == 20

    def over_time(now, state):
        place, speed = state
        resistance = 5854.0 + 74.16 * speed + 12.96 * speed**2
        return [speed, (np.interp(place, x, net) - resistance) / (391e3 * 1.06)]

    run = solve_ivp(over_time, (0.0, t[-1]), [x[0], v[0]], rtol=1e-10, atol=1e-10, max_step=0.5, t_eval=t)
    assert run.y[0] == pytest.approx(x, abs=2e-3)
    assert run.y[1] == pytest.approx(v, abs=2e-4)


def test_a_timetable_along_the_rows_has_their_accelerations(virm):
    found = profile_of(virm.solution)
    motions = Profile.through([row[1::-1] + row[2:3] for row in zip(*found, strict=True)]).motions
    at = {motion.position: motion.acceleration for motion in motions}
    slow = virm.solution.inside < 10.0
    given = virm.solution.accelerations[slow]
    assert len(given) == 24
    assert [at[x] for x in virm.solution.places[slow]] == pytest.approx(given, abs=2e-3)


@pytest.fixture
def rows(hop):
    """Solves the hop, changed; the optimum and its profile's columns."""

    def solved(*settings, **changes):
        optimum = optimise(hop(*settings, **changes))
        return optimum, profile_of(optimum.solution)

    return solved


def test_limits_hold_under_the_whole_train_and_comfort_too(rows):
    optimum, (x, t, v, traction, brake) = rows()
    slow = (x > 1000.0) & (x <= 1460.0)  # until its rear has left
    assert v[slow].max() <= 16.0 + 1e-6
    assert v.max() <= 22.0 + 1e-6
    points = optimum.solution.places.ravel()
    neutral = (points > 400.0) & (points < 520.0)
    for name in ("traction", "regeneration"):
        assert optimum.solution.forces[name].ravel()[neutral].max() < 1.0
    accelerations = optimum.solution.accelerations
    assert -0.6 - 1e-6 <= accelerations.min() < accelerations.max() <= 0.7 + 1e-6
    assert optimum.solution.forces["regeneration"].max() <= 60e3 + 1e-2
    quotients = np.diff(v) / np.diff(t)
    assert quotients.max() < 0.75
    assert quotients.min() > -0.65
    assert min(traction.min(), brake.min()) >= 0.0


def test_the_least_time_and_what_is_below_it(hop):
    plain = ("line.neutral_sections=[]", "end=700", "intervals=10")
    quickest = optimise(hop(*plain, minimize="time")).solution
    assert optimise(hop(*plain, time=quickest.time * 1.005)).solution.energy < quickest.energy
    told = rf"hop: 40 s are too short: the least running time is {quickest.time:.2f} s; give a longer 'time'"
    with pytest.raises(ScenarioError, match=told):
        optimise(hop(*plain, time=40.0))


def test_each_mesh_is_told_before_it_is_solved(hop):
    told = []
    optimum = optimise(hop("line.neutral_sections=[]"), lambda *mesh: told.append(mesh))
    assert told == list(enumerate([optimum.meshes[0], *optimum.meshes])), "the least time comes first, on the same mesh"
    assert len(told) > 2


def test_without_regeneration_it_costs_more(rows):
    optimum, _ = rows("regeneration=false")
    assert optimum.solution.energy > rows()[0].solution.energy * 1.01
    assert optimum.solution.forces["regeneration"].max() == 0.0


def test_a_reserve_is_left_of_forces_and_powers(rows):
    optimum, (_, _, v, traction, _) = rows("reserve=0.1")
    assert traction.max() <= 0.9 * 100e3 + 1e-2
    assert (traction * v).max() <= 0.9 * 1.2e6 * (1.0 + 1e-6)
    assert optimum.solution.energy > rows()[0].solution.energy


def test_forces_change_no_faster_than_a_jerk_limit(rows):
    optimum, _ = rows("jerk=0.1")
    times, net = optimum.solution.times.ravel(), optimum.solution.net.ravel()
    assert np.abs(np.diff(net) / np.diff(times)).max() <= 0.1 * 120e3 * 1.05  # the mean speed makes it up to a share


def test_a_mesh_that_is_fine_enough_stays(rows):
    line = ("line.sections=[{ position = 0.0 }]", "line.speed_limits=[[0.0, 25.0]]", "line.neutral_sections=[]")
    even, _ = rows("train.traction.force=5e6", *line)  # no force changes by much of that
    assert (even.meshes, even.change) == ([len(even.solution.nodes) - 1], None)


def test_nothing_drives_up_a_wall(hop):
    with pytest.raises(ScenarioError, match=r"hop: IPOPT finds no driving that keeps all limits \(.*\); look whether"):
        optimise(hop("line.sections=[{ position = 0.0, gradient = 0.12 }]"))


def test_a_hilly_line_under_a_jerk_limit_is_driven_as_scipy_integrates_it(hop, tmp_path):
    solution = optimise(hop("jerk=0.3", "intervals=40", "tolerance=1e-3")).solution
    x, t, v, traction, brake = np.loadtxt(write_profile(tmp_path, solution), delimiter=",", skiprows=1, unpack=True)
    force = traction - brake

    def height(place):
        return np.interp(place, [0.0, 800.0, 1500.0, 2500.0], [0.0, 0.0, 7.0, -3.0])

    def over_time(now, state):
        place, speed = state
        slope = 120e3 * 9.81 * (height(place) - height(place - 60.0)) / 60.0  # the mean under the train
        resistance = 2400.0 + 60.0 * speed + 6.0 * speed**2
        return [speed, (np.interp(now, t, force) - resistance - slope) / (120e3 * 1.1)]

    run = solve_ivp(over_time, (0.0, t[-1]), [0.0, 1.0], rtol=1e-8, atol=1e-8, max_step=1.0, t_eval=t)
    assert run.y[0] == pytest.approx(x, abs=2.0)  # forces between rows are straight lines here
    assert run.y[1] == pytest.approx(v, abs=0.03)
    assert t[-1] == pytest.approx(190.0, abs=1e-3)
    assert np.abs(np.diff(force) / np.diff(t)).max() <= 0.3 * 120e3 * 1.03  # as below
    electric = np.where((x > 400.0) & (x < 520.0), 0.0, np.minimum(60e3, 1.2e6 / v))
    energy = trapezoid(traction / 0.9 - 0.8 * np.minimum(brake, electric), x)
    assert energy == pytest.approx(solution.energy, rel=3e-3)


def test_slopes_begin_on_the_mesh(hop):
    nodes = optimise(hop("line.neutral_sections=[]", tolerance=0.1)).solution.nodes
    assert {800.0, 860.0, 1500.0, 1560.0} <= set(nodes)
