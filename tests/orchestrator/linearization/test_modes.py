"""What eigenvalues say: verdicts, modes and their names, for matrices whose eigenvalues are known by hand."""

import numpy as np
import pytest
from railcosim.orchestrator.linearization.modes import stability

# ---------------------------------------------------------------- what eigenvalues say


@pytest.mark.parametrize(
    ("a", "verdict", "words"),
    [
        ([[-1.0, 0.0], [0.0, -2.0]], "stable", "every deviation decays"),
        ([[0.0, 1.0], [0.0, -2.0]], "stable", "but for 1 mode that nothing pulls back (x0)"),
        ([[0.0, 1.0], [0.0, 0.0]], "drifts", "a push sends it off for ever"),
        ([[0.0, 1.0], [-4.0, 0.0]], "undamped", "at 2 rad/s"),
        ([[0.0, 1.0], [-4.0, 0.2]], "unstable", "2 modes grow, the fastest by e in 10 s"),
    ],
)
def test_verdicts(a, verdict, words, a_model):
    found = stability(a_model(a, [0, 1], np.eye(2)))
    assert found.verdict == verdict
    assert words in found.text


def test_a_pair_is_one_mode_with_its_damping(a_model):
    """s^2 + 2 zeta w s + w^2 with zeta = 0.3, w = 2."""
    (mode,) = stability(a_model([[0.0, 1.0], [-4.0, -1.2]], [0, 1], [1, 0])).modes
    assert (mode.count, mode.damping, mode.frequency) == pytest.approx((2, 0.3, 2.0))
    assert mode.time_constant == pytest.approx(1.0 / 0.6)


def test_discrete_modes_are_told_in_seconds_and_delays_as_gone(a_model):
    """z = exp(-h / 5) decays in 5 s; a chain of three delays is gone, whatever rounding makes of its eigenvalues."""
    a = np.zeros((4, 4))
    a[0, 0], a[1, 0], a[2, 1], a[3, 2] = np.exp(-0.1 / 5.0), 1.0, 1.0, 1.0
    found = stability(a_model(a, [1, 0, 0, 0], [1, 0, 0, 1], step=0.1))
    slow, gone = found.modes
    assert slow.time_constant == pytest.approx(5.0)
    assert (gone.count, gone.pole.real) == (3, -np.inf)
    assert found.verdict == "stable"


def test_what_reaches_no_output_is_not_seen_but_judged(a_model):
    found = stability(a_model([[-1.0, 0.0], [0.0, 0.5]], [1, 0], [1, 0]))
    assert [mode.seen for mode in found.modes] == [False, True]
    assert found.verdict == "unstable"
    assert found.slowest is not None
    assert found.slowest.time_constant == pytest.approx(1.0)


def test_neutral_modes_have_no_damping_and_no_time_constant(a_model):
    """A train that rolls: position and speed, of which nothing pulls the first."""
    found = stability(a_model([[0.0, 1.0], [0.0, -2.0]], [0, 1], np.eye(2)))
    still, slow = found.modes
    assert (still.frequency, still.time_constant) == (0.0, np.inf)
    assert np.isnan(still.damping)
    assert (slow.damping, slow.time_constant) == (1.0, 0.5)


def test_a_mode_that_grows_has_a_negative_time_constant(a_model):
    (mode,) = stability(a_model([[0.25]], [1], [1])).modes
    assert mode.time_constant == -4.0
    assert stability(a_model([[0.25]], [1], [1])).slowest is None


def test_equal_modes_of_several_trains_are_one_with_all_their_names(a_model):
    """Five trains slow down alike, each for itself; three further ones alike, but faster."""
    states = [f"train[{i}].speed" for i in (1, 2, 3, 5, 7)] + [f"cruise[{i}].memory" for i in (1, 2)] + ["line.x"]
    a = np.diag([-0.5] * 5 + [-2.0] * 3)
    slow, fast = stability(a_model(a, np.ones(8), np.eye(8), states=states)).modes
    assert (slow.count, slow.states) == (5, ("train[1–3, 5, 7].speed",))
    assert (fast.count, fast.states) == (3, ("cruise[1, 2].memory", "line.x"))


def test_more_than_three_families_are_cut_short(a_model):
    states = [f"{name}.x" for name in "abcde"]
    (mode,) = stability(a_model(-np.eye(5), np.ones(5), np.eye(5), states=states)).modes
    assert mode.states == ("a.x", "b.x", "c.x", "...")


def test_the_slowest_mode_of_each_variable(a_model):
    """Speeds settle in 2 s, positions in 10 s; what is gone after one step, and what stays, is no mode to wait for."""
    states = ["train[1].speed", "train[1].position", "train[2].position", "delay.x", "trip.count"]
    a = np.diag([np.exp(-0.5), np.exp(-0.1), np.exp(-0.2), 0.0, 1.0])
    found = stability(a_model(a, np.ones(5), np.eye(5), states=states, step=1.0))
    constants = {name: mode.time_constant for name, mode in found.slowest_by_variable.items()}
    assert constants == pytest.approx({"speed": 2.0, "position": 10.0})
    assert found.slowest.time_constant == pytest.approx(10.0)


def test_a_discrete_oscillation_is_told_at_its_angular_frequency(a_model):
    """A rotation by 30 degrees in each step of 0.1 s."""
    turn = np.pi / 6.0
    a = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    found = stability(a_model(a, [1, 0], np.eye(2), step=0.1))
    assert found.verdict == "undamped"
    assert found.modes[0].frequency == pytest.approx(turn / 0.1)


def test_a_double_eigenvalue_with_one_eigenvector_has_both_its_states(a_model):
    """(s + 1)^2: its matrix of eigenvectors has no inverse."""
    (mode,) = stability(a_model([[-1.0, 1.0], [-1e-30, -1.0]], [0, 1], np.eye(2))).modes
    assert mode.count == 2
    assert mode.time_constant == pytest.approx(1.0)


def test_without_states_all_is_still(a_model):
    found = stability(a_model(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0))))
    assert (found.verdict, found.modes, found.slowest) == ("stable", (), None)
