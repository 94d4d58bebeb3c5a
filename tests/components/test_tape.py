"""The tape: learning from trip to trip, the filter between trips, and the file that carries it over."""

import json
import math

import numpy as np
import pytest
from railcosim.components import Simulation
from railcosim.components.tape import smooth
from scipy import signal

STEP, TRIP, WAIT = 0.1, 2.0, 0.5
SAMPLES = round(TRIP / STEP) + 1
WAITS = round(WAIT / STEP)


def learner(samples, **values):
    simulation = Simulation(samples.Learner(**{"sample_time": STEP, "tape_duration": TRIP} | values))
    simulation.initialize(0.0)
    simulation.set("trip_time", -WAIT)
    simulation.start()
    return simulation


def disturbance(trip_time):
    return math.sin(2.0 * trip_time) + 0.3 * trip_time


def run_trip(simulation, number, spoiled_at=None, last=SAMPLES):
    """A wait and a trip under way; gives the error at each sample of the trip."""
    errors = []
    simulation.set("trip", number)
    for k in range(-WAITS, last):
        simulation.set("trip_time", k * STEP)
        simulation.set("spoiled", k == spoiled_at)
        error = disturbance(k * STEP) - simulation.get("command") if k >= 0 else 0.0
        simulation.set("error", error)
        simulation.step(STEP)
        if k >= 0:
            errors.append(error)
    return np.array(errors)


def test_learning_shrinks_the_error_by_its_gain_each_trip(samples):
    """Analytic: command_k+1 = command_k + g e_k, so e_k = (1 - g)^(k-1) e_1 at every sample."""
    simulation = learner(samples, gain=0.4)
    first = run_trip(simulation, 1)
    assert first == pytest.approx([disturbance(k * STEP) for k in range(SAMPLES)])
    for trip in range(2, 6):
        assert run_trip(simulation, trip) == pytest.approx(0.6 ** (trip - 1) * first, rel=1e-12, abs=1e-14)


def test_nothing_is_learned_within_a_trip(samples):
    simulation = learner(samples)
    run_trip(simulation, 1)
    simulation.set("trip_time", 0.3)
    assert simulation.get("command") == 0.0


def test_a_wait_reads_the_start_row(samples):
    simulation = learner(samples)
    run_trip(simulation, 1)
    run_trip(simulation, 2)
    simulation.set("trip_time", 0.5)
    assert simulation.get("command") != 0.0
    simulation.set("trip_time", -0.1)
    assert simulation.get("command") == 0.0
    assert simulation.get("pair_seen").tolist() == [7.0, 7.0]


def test_an_array_on_the_tape_keeps_its_elements_apart(samples):
    """By hand: the update adds +-0.5 e, that is |e|/2, to both elements."""
    simulation = learner(samples)
    errors = run_trip(simulation, 1)
    simulation.set("trip", 2)
    simulation.set("trip_time", -0.1)
    simulation.step(STEP)
    simulation.set("trip_time", 0.4)
    assert simulation.get("pair_seen") == pytest.approx([7.0 + 0.5 * abs(errors[4])] * 2)


def test_keep_drops_a_spoiled_trip(samples):
    simulation = learner(samples)
    first = run_trip(simulation, 1)
    spoiled = run_trip(simulation, 2, spoiled_at=7)
    assert run_trip(simulation, 3) == pytest.approx(spoiled, abs=1e-14)
    assert run_trip(simulation, 4) == pytest.approx(0.25 * first, abs=1e-14)


def test_a_shorter_trip_leaves_the_rest_of_the_tape(samples):
    simulation = learner(samples, tape_cutoff=0.5)
    run_trip(simulation, 1)
    run_trip(simulation, 2)
    run_trip(simulation, 3, last=0)
    before = simulation.save()["tape"]["committed"]
    run_trip(simulation, 3, last=8)
    run_trip(simulation, 4, last=1)
    after = simulation.save()["tape"]["committed"]
    assert after[8:] == before[8:]
    assert after[:8] != before[:8]


def test_the_filter_between_trips_sees_the_trip_only(samples):
    """Reference: `smooth` on the rows of the trip alone; the unused rest of a longer tape must not leak in."""
    long, fitting = learner(samples, tape_cutoff=1.0, tape_duration=30.0), learner(samples, tape_cutoff=1.0)
    raw = learner(samples)
    for simulation in (long, fitting, raw):
        run_trip(simulation, 1)
        run_trip(simulation, 2, last=0)
    rows = [np.array(s.save()["tape"]["committed"]) for s in (long, fitting, raw)]
    assert rows[0].shape == (301, 3)
    assert (rows[0][:SAMPLES] == rows[1]).all()
    assert (rows[0][:SAMPLES] == smooth(rows[2], 1.0, STEP)).all()
    assert not np.allclose(rows[1], rows[2])


def test_a_step_of_several_samples_records_every_row(samples):
    """The inputs are held over the step, the tape runs on: rows 2k and 2k + 1 learn the same error."""
    simulation = learner(samples)
    simulation.set("trip", 1)
    for k in range(0, 20, 2):
        simulation.set("trip_time", k * STEP)
        simulation.set("error", float(k))
        simulation.step(2 * STEP)
    simulation.set("trip", 2)
    simulation.set("trip_time", -2 * STEP)
    simulation.step(2 * STEP)
    learned = np.array(simulation.save()["tape"]["committed"])[:20, 0]
    assert learned.tolist() == [0.5 * (k - k % 2) for k in range(20)]


def test_a_wait_stays_a_wait_through_a_step_of_several_samples(samples):
    """The equations still see a negative time along the trip: nothing they compute belongs to the departure."""
    simulation = learner(samples)
    simulation.set("trip_time", -STEP)
    simulation.set("error", 8.0)
    simulation.step(2 * STEP)
    assert simulation.save()["tape"]["span"] is None


# ---------------------------------------------------------------- messages


def test_the_trip_may_change_only_while_waiting(samples, refusal):
    simulation = learner(samples)
    run_trip(simulation, 1, last=3)
    simulation.set("trip", 2)
    text = refusal(lambda: simulation.step(STEP))
    assert text.startswith(
        "Learner: the trip number changed from 1 to 2 at trip_time = 0.2 s; it may change only while"
    )


def test_a_departure_with_a_rounding_error_is_a_departure(samples, refusal):
    simulation = learner(samples)
    run_trip(simulation, 1)
    simulation.set("trip", 2)
    simulation.set("trip_time", -1e-14)
    assert "changed from 1 to 2" in refusal(lambda: simulation.step(STEP))


def test_off_the_grid_and_past_the_end(samples, refusal):
    simulation = learner(samples)
    simulation.set("trip_time", 0.25)
    assert simulation.get("command") == 0.0  # between samples it reads what it read at the last one
    assert refusal(lambda: simulation.step(STEP)) == (
        "Learner: trip_time = 0.25 s is not a multiple of sample_time = 0.1 s"
    )
    simulation.set("trip_time", 2.1)
    assert refusal(lambda: simulation.get("command")).endswith("past the end of the tape; raise tape_duration")
    simulation.set("trip_time", 0.3 + 1e-12)
    simulation.get("command")


def test_a_tape_needs_a_sample_time(samples, refusal):
    simulation = Simulation(samples.Learner())
    simulation.initialize()
    assert refusal(simulation.start) == "Learner.sample_time must be set: a tape is recorded on a fixed grid"


# ---------------------------------------------------------------- filter


def wave(n=200):
    return np.column_stack([np.sin(0.1 * np.arange(n)), np.random.default_rng(1).normal(size=n)])


def test_the_filter_against_scipy():
    """Reference: `scipy.signal.filtfilt` of the same first-order low-pass with odd padding and its own start state."""
    cutoff, step = 1.0, 0.05
    gain = 1.0 - math.exp(-2.0 * math.pi * cutoff * step)
    rows = wave()
    expected = signal.filtfilt([gain], [1.0, gain - 1.0], rows, axis=0, padtype="odd", padlen=150)
    assert np.abs(smooth(rows, cutoff, step) - expected).max() < 1e-5
    assert np.abs(smooth(rows, cutoff, step) - rows).max() > 0.5


def test_the_filter_has_no_phase():
    """A symmetric pulse stays symmetric and keeps its place; its sum, the DC gain, stays 1."""
    pulse = np.zeros((401, 1))
    pulse[200] = 1.0
    smoothed = smooth(pulse, 1.0, 0.05)[:, 0]
    assert smoothed.argmax() == 200
    assert np.abs(smoothed - smoothed[::-1]).max() < 1e-15
    assert smoothed.sum() == pytest.approx(1.0, abs=1e-12)


def test_the_filter_keeps_constants_and_ramps_to_the_very_ends():
    """Odd reflection continues a ramp, and forward lag and backward lead cancel."""
    constant, ramp = np.full((300, 1), 3.7), np.linspace(-2.0, 5.0, 300)[:, None]
    assert smooth(constant, 1.0, 0.05) == pytest.approx(constant, abs=1e-14)
    assert np.abs(smooth(ramp, 1.0, 0.05) - ramp).max() < 1e-5


@pytest.mark.parametrize("n", [1, 2, 3, 5])
def test_the_filter_takes_trips_shorter_than_its_run_in(n):
    """A ramp reflected over and over goes on as a ramp."""
    rows = np.linspace(0.0, 1.0, n)[:, None] + np.zeros((n, 2))
    smoothed = smooth(rows, 1.0, 0.05)
    assert smoothed.shape == (n, 2)
    assert smoothed == pytest.approx(rows, abs=1e-4)


def test_the_filter_damps_as_a_first_order_low_pass_squared():
    """Analytic: amplitude 1 / |1 - (1-g) e^-jw| g, squared because it runs twice."""
    cutoff, step = 1.0, 0.01
    gain, omega = 1.0 - math.exp(-2.0 * math.pi * cutoff * step), 2.0 * math.pi * 3.0 * step
    response = gain / abs(1.0 - (1.0 - gain) * np.exp(-1j * omega))
    rows = np.sin(omega * np.arange(2000))[:, None]
    middle = smooth(rows, cutoff, step)[900:1100, 0]
    assert middle == pytest.approx(response**2 * rows[900:1100, 0], abs=1e-9)


def test_no_cutoff_copies():
    rows = wave()
    same = smooth(rows, 0.0, 0.05)
    assert (same == rows).all()
    assert same is not rows


# ---------------------------------------------------------------- file


def saved_tape(simulation):
    return np.array(simulation.save()["tape"]["committed"])


def test_the_file_survives_the_round_trip_exactly(samples, tmp_path):
    path = tmp_path / "learned.tape"
    first = learner(samples, gain=1.0 / 3.0, tape_file=str(path))
    for trip in (1, 2, 3):
        run_trip(first, trip)
    first.terminate()
    again = learner(samples, tape_file=str(path))
    assert (saved_tape(again) == saved_tape(first)).all()
    assert path.read_text().splitlines()[0] == "railcosim tape 1 component=Learner sample_time=0.1 rows=21 columns=3"
    assert path.read_text().splitlines()[-1] == "end"
    assert [p.name for p in tmp_path.iterdir()] == ["learned.tape"]


@pytest.mark.parametrize("cutoff", [0.0, 2.0])
def test_two_simulations_of_five_trips_joined_by_a_file_equal_one_of_ten(samples, tmp_path, cutoff):
    path = str(tmp_path / "learned.tape")
    whole = learner(samples, tape_cutoff=cutoff)
    expected = [run_trip(whole, trip) for trip in range(1, 11)]
    found = []
    for trips in (range(1, 6), range(6, 11)):
        part = learner(samples, tape_cutoff=cutoff, tape_file=path)
        found += [run_trip(part, trip) for trip in trips]
        part.terminate()
    assert np.array_equal(found, expected)
    assert np.abs(expected[9]).max() < 0.5 * np.abs(expected[0]).max()


def test_a_run_that_never_began_leaves_no_file(samples, tmp_path):
    simulation = Simulation(samples.Learner(sample_time=STEP, tape_file=str(tmp_path / "learned.tape")))
    simulation.initialize()
    simulation.get("command")
    simulation.terminate()
    assert not list(tmp_path.iterdir())


def test_a_spoiled_last_trip_does_not_reach_the_file(samples, tmp_path):
    path = tmp_path / "learned.tape"
    simulation = learner(samples, tape_file=str(path))
    run_trip(simulation, 1, spoiled_at=3)
    simulation.terminate()
    assert (saved_tape(learner(samples, tape_file=str(path)))[:, 0] == 0.0).all()


def test_the_file_is_read_before_the_first_output(samples, tmp_path):
    """Initialization mode demands fresh values: time zero of the results must already know what was learned."""
    path = tmp_path / "learned.tape"
    first = learner(samples, tape_file=str(path))
    errors = run_trip(first, 1)
    first.terminate()
    simulation = Simulation(samples.Learner(sample_time=STEP, tape_duration=TRIP))
    simulation.initialize()
    simulation.set("trip_time", 0.5)
    assert simulation.get("command") == 0.0
    simulation.set("tape_file", str(path))
    assert simulation.get("command") == 0.5 * errors[5]
    simulation.start()
    assert simulation.get("command") == 0.5 * errors[5]


@pytest.mark.parametrize(
    ("spoil", "expected"),
    [
        (lambda lines: ["hello", *lines[1:]], "is not a tape file; remove it to start anew"),
        (lambda lines: [], "is not a tape file; remove it to start anew"),
        (lambda lines: [lines[0].replace("Learner", "Other"), *lines[1:]], "it says 'railcosim tape 1 component=Other"),
        (lambda lines: [lines[0].replace("=0.1", "=0.2"), *lines[1:]], "expected 'railcosim tape 1 component=Learner"),
        (lambda lines: lines[:-1], "is corrupt: it is cut short"),
        (lambda lines: lines[:10], "is corrupt: it is cut short"),
        (lambda lines: [*lines[:5], "1.0 2.0", *lines[6:]], "is corrupt: line 6 is incomplete or not finite"),
        (lambda lines: [*lines[:5], "1.0 2.0 nan", *lines[6:]], "is corrupt: line 6 is incomplete or not finite"),
        (lambda lines: [*lines[:5], "1.0 2.0 x", *lines[6:]], "is corrupt: could not convert string to float: 'x'"),
    ],
)
def test_a_file_that_does_not_fit_says_why(samples, tmp_path, spoil, expected, refusal):
    path = tmp_path / "learned.tape"
    simulation = learner(samples, tape_file=str(path))
    run_trip(simulation, 1)
    simulation.terminate()
    path.write_text("\n".join(spoil(path.read_text().splitlines())) + "\n")
    text = refusal(lambda: learner(samples, tape_file=str(path)))
    assert text.startswith(f"Learner.tape_file: {path}")
    assert expected in text


def test_a_file_of_bytes_or_a_missing_folder_is_told(samples, tmp_path, refusal):
    (tmp_path / "noise.tape").write_bytes(bytes(range(256)))
    assert "cannot be read" in refusal(lambda: learner(samples, tape_file=str(tmp_path / "noise.tape")))
    simulation = learner(samples, tape_file=str(tmp_path / "no" / "such.tape"))
    run_trip(simulation, 1)
    assert "cannot be written" in refusal(simulation.terminate)


# ---------------------------------------------------------------- state


def test_a_restore_in_the_middle_of_a_trip_gives_the_same_bits(samples):
    simulation = learner(samples, tape_cutoff=1.0)
    run_trip(simulation, 1)
    run_trip(simulation, 2, last=9)
    state = json.loads(simulation.to_bytes())

    def rest(s):
        for k in range(9, SAMPLES):
            s.set("trip_time", k * STEP)
            s.set("error", disturbance(k * STEP) - s.get("command"))
            s.step(STEP)
        return [run_trip(s, 3), run_trip(s, 4), saved_tape(s)]

    expected = rest(simulation)
    other = Simulation(samples.Learner())
    other.restore(state)
    for a, b in zip(rest(other), expected, strict=True):
        assert np.array_equal(a, b)


def test_a_restore_at_the_end_of_a_trip_still_commits_it(samples):
    simulation = learner(samples)
    run_trip(simulation, 1)
    other = Simulation(samples.Learner())
    other.restore(json.loads(simulation.to_bytes()))
    assert np.array_equal(run_trip(other, 2), run_trip(simulation, 2))
    assert (saved_tape(other)[:, 0] != 0.0).any()


def test_reset_forgets_what_was_learned(samples):
    simulation = learner(samples)
    expected = [run_trip(simulation, trip) for trip in (1, 2)]
    simulation.reset()
    simulation.initialize()
    simulation.set("trip_time", -WAIT)
    simulation.start()
    assert np.array_equal([run_trip(simulation, trip) for trip in (1, 2)], expected)
