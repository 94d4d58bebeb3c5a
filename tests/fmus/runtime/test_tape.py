"""tape.c: the file that learning is kept in."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from railcosim.components.errors import ComponentError
from railcosim.components.tape import TapeDeck, smooth
from railcosim.fmus.build import build
from railcosim.fmus.references import resolve

OTHERS = Path(__file__).parents[2] / "components" / "samples.py"
LEARNER = f"{OTHERS}:Learner"
OK = 0
ERROR = 3


# ---------------------------------------------------------------- the tape


def learner(load, path, **starts):
    fmu = load(LEARNER)
    return fmu.initialize(sample_time=0.1, tape_duration=1.0, tape_file=str(path), **starts)


def ride(fmu, trip, errors):
    length = 0.1
    for k, error in enumerate([0.0, *errors]):
        fmu.set("trip", trip)
        fmu.set("trip_time", (k - 1) * length)
        fmu.set("error", error)
        assert fmu.step(length) == OK, fmu.said


def python_deck(gain_errors, cutoff=0.0):
    """A deck that recorded the same: column 1 the learned value, columns 2 and 3 the pair."""
    learner_class = resolve(LEARNER)
    component = learner_class()
    slots = tuple(component.slots[n] for n in ("learned", "pair"))
    deck = TapeDeck("Learner", slots, component.present_values, sample_time=0.1, duration=1.0, cutoff=cutoff)
    for n, error in enumerate(gain_errors):
        half = 0.5 * abs(error)
        deck.record(n * 0.1, {"learned": 0.5 * error, "pair": np.array([7.0 + half, 7.0 + half])})
    deck.commit(lambda: True)
    return deck


ERRORS = (1.0, -2.0, 1 / 3, 1e-300, 1e22, 123456789.0, 0.1, 1e16, 12345.678e-10)


@pytest.mark.parametrize("cutoff", [0.0, 0.05, 0.9, 40.0])
def test_the_tape_file_is_the_one_that_python_writes_byte_for_byte(load, tmp_path, cutoff):
    """Filtered between trips also where the pad is longer than the trip."""
    fmu = learner(load, tmp_path / "native", tape_cutoff=cutoff)
    ride(fmu, 1, ERRORS)
    assert fmu.Terminate() == OK
    deck = python_deck(ERRORS, cutoff)
    deck.save(tmp_path / "python")
    assert (tmp_path / "native").read_bytes() == (tmp_path / "python").read_bytes()
    assert not (tmp_path / "native.part").exists()


def test_a_trip_of_one_sample_is_kept_as_it_is(load, tmp_path):
    fmu = learner(load, tmp_path / "native", tape_cutoff=1.0)
    ride(fmu, 1, [3.0])
    assert fmu.Terminate() == OK
    python_deck([3.0], 1.0).save(tmp_path / "python")
    assert (tmp_path / "native").read_bytes() == (tmp_path / "python").read_bytes()
    assert smooth(np.array([[1.5]]), 1.0, 0.1) == 1.5


@pytest.mark.parametrize("ends", [b"\n", b"\r\n"])
def test_the_file_is_read_back(load, tmp_path, ends):
    path = tmp_path / "tape"
    deck = python_deck(ERRORS)
    deck.save(path)
    path.write_bytes(path.read_bytes().replace(b"\n", ends))
    fmu = learner(load, path)
    fmu.set("trip_time", 0.2)
    assert fmu.get("command") == deck.committed[2, 0]
    fmu.set("trip_time", 0.4)
    assert fmu.get("pair_seen[2]") == deck.committed[4, 2]


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda t: "nonsense\n", "not a tape file"),
        (lambda t: "", "not a tape file"),
        (lambda t: t.replace("sample_time=0.1", "sample_time=0.2"), "does not fit"),
        (lambda t: t.replace("Learner", "Teacher"), "does not fit"),
        (lambda t: t.removesuffix("end\n"), "corrupt"),
        (lambda t: t + "\n", "corrupt"),
        (lambda t: t.replace("\n0.5 ", "\nnan ", 1), "corrupt"),
        (lambda t: t.replace("\n0.5 ", "\n", 1), "corrupt"),
        (lambda t: t.replace("\n0.5 ", "\n0.5x ", 1), "corrupt"),
        (lambda t: t.replace("\n0.5 ", "\n ", 1), "corrupt"),
        (lambda t: t[: t.index("\n0.5 ") + 3], "corrupt"),
        (lambda t: t.replace("end\n", "End\n"), "corrupt"),
        (lambda t: t.replace("\n0.5 ", "\n0.5 1.0 ", 1), "corrupt"),
        (lambda t: t.replace("\n0.5 ", "\n" + "1" * 500 + " ", 1), "corrupt"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_with_the_reason(load, tmp_path, spoil, said):
    path = tmp_path / "tape"
    python_deck(ERRORS).save(path)
    text = path.read_text()
    path.write_text(spoil(text))
    assert path.read_text() != text
    fmu = load(LEARNER).enter()
    fmu.set("sample_time", 0.1)
    fmu.set("tape_duration", 1.0)
    fmu.set("tape_file", str(path))
    assert fmu.ExitInitializationMode() == ERROR
    assert said in fmu.said
    assert path.read_text() == spoil(text)


def test_a_tape_that_cannot_be_is_refused(load):
    for starts, said in (
        ({"sample_time": 0.0}, "sample_time must be set"),
        ({"sample_time": 1e-9, "tape_duration": 1e9}, "cannot be"),
        ({"sample_time": 0.1, "tape_duration": -5.0}, "cannot be"),
        ({"sample_time": 1e-6, "tape_cutoff": 1e-6}, "too low"),
    ):
        fmu = load(LEARNER).enter()
        for name, value in starts.items():
            fmu.set(name, value)
        assert fmu.status_of_get("command") == ERROR
        assert said in fmu.said


LOCALE = """
import locale
locale.setlocale(locale.LC_ALL, sys.argv[5])
assert locale.localeconv()["decimal_point"] != "."
fmu = bare.Fmu(Path(sys.argv[3])).initialize(sample_time=0.1, tape_duration=1.0, tape_file=sys.argv[4])
tests.ride(fmu, 1, tests.ERRORS)
assert fmu.Terminate() == 0
again = bare.Fmu(Path(sys.argv[3])).initialize(sample_time=0.1, tape_duration=1.0, tape_file=sys.argv[4])
again.set("trip_time", 0.2)
assert again.get("command") == 0.5 * tests.ERRORS[2]
"""


@pytest.mark.long
def test_the_file_does_not_depend_on_the_locale_of_the_host(tmp_path, unpack, monkeypatch, in_another_process):
    """A German host writes 0,5: the file must say 0.5."""
    archive = tmp_path / "locales"
    archive.mkdir()
    if shutil.which("localedef") is not None:
        command = ["localedef", "-i", "de_DE", "-f", "UTF-8", str(archive / "de_DE.utf8")]
        subprocess.run(command, capture_output=True, check=False)
    if not (archive / "de_DE.utf8").exists():
        pytest.skip("localedef cannot make a German locale here")
    folder = unpack(build(LEARNER, kind="native"))
    monkeypatch.setenv("LOCPATH", str(archive))
    in_another_process(LOCALE, __file__, folder, tmp_path / "native", "de_DE.utf8")
    python_deck(ERRORS).save(tmp_path / "python")
    assert (tmp_path / "native").read_bytes() == (tmp_path / "python").read_bytes()


@pytest.mark.parametrize(
    ("trip_time", "said"),
    [(0.25, "is not a multiple of sample_time = 0.1"), (5.0, "is past the end of the tape; raise tape_duration")],
)
def test_a_time_without_a_place_on_the_tape_is_an_error(load, tmp_path, trip_time, said):
    """Where it is read, but for a time between two samples, which reads the last one; and where a step records it."""
    fmu = learner(load, tmp_path / "tape")
    assert fmu.set("trip_time", trip_time) == OK
    assert fmu.status_of_get("command") == (OK if trip_time < 1.0 else ERROR)
    assert trip_time < 1.0 or said in fmu.said
    other = learner(load, tmp_path / "tape")
    assert other.set("trip_time", trip_time) == OK
    assert other.step(0.1) == ERROR
    assert said in other.said


def test_a_step_past_the_end_of_the_tape_is_an_error(load, tmp_path):
    """Within a step of several samples the tape runs on by itself."""
    fmu = learner(load, tmp_path / "tape")
    assert fmu.set("trip_time", 0.9) == OK
    assert fmu.step(0.4) == ERROR
    assert "past the end of the tape" in fmu.said


def test_a_path_that_leads_nowhere_is_refused(load, tmp_path):
    """A file in the place of a folder is no tape that has not been written yet."""
    (tmp_path / "file").write_text("")
    fmu = load(LEARNER).enter()
    for name, value in (("sample_time", 0.1), ("tape_duration", 1.0), ("tape_file", str(tmp_path / "file" / "tape"))):
        fmu.set(name, value)
    assert fmu.ExitInitializationMode() == ERROR
    assert "tape/tape cannot be read" in fmu.said.replace("file/tape", "tape/tape")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
def test_a_full_disk_leaves_the_tape_of_before(load, tmp_path):
    path = tmp_path / "tape"
    python_deck(ERRORS).save(path)
    before = path.read_bytes()
    fmu = learner(load, path)
    ride(fmu, 1, ERRORS)
    (tmp_path / "tape.part").symlink_to("/dev/full")
    assert fmu.Terminate() == ERROR
    assert "cannot be written" in fmu.said
    assert path.read_bytes() == before
    assert not (tmp_path / "tape.part").exists()


def test_a_place_that_is_taken_is_told(load, tmp_path):
    fmu = learner(load, tmp_path / "tape")
    (tmp_path / "tape").mkdir()
    assert fmu.Terminate() == ERROR
    assert "cannot be written" in fmu.said
    assert [path.name for path in tmp_path.iterdir()] == ["tape"]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
def test_a_disk_that_is_full_before_the_end_is_told(load, tmp_path):
    """Of a tape longer than what is buffered."""
    fmu = load(LEARNER).initialize(sample_time=0.1, tape_duration=100.0, tape_file=str(tmp_path / "tape"))
    (tmp_path / "tape.part").symlink_to("/dev/full")
    assert fmu.Terminate() == ERROR
    assert "cannot be written" in fmu.said
    assert not list(tmp_path.iterdir())


GREATEST = [1.7e308, -1.7e308] * 4


def test_a_filter_that_goes_beyond_all_numbers_is_an_error_and_writes_nothing(load, tmp_path):
    """At the next trip, and at the end; in Python too."""
    for ends in (True, False):
        fmu = learner(load, tmp_path / "tape", tape_cutoff=0.05)
        ride(fmu, 1, GREATEST)
        if not ends:
            fmu.set("trip", 2)
            fmu.set("trip_time", -0.1)
        assert (fmu.Terminate() if ends else fmu.step(0.1)) == ERROR
        assert "the filter takes what was recorded beyond all numbers" in fmu.said
    assert not list(tmp_path.iterdir())
    with pytest.raises(ComponentError, match="the filter takes what was recorded beyond all numbers"):
        python_deck(GREATEST, 0.05)


def test_a_trip_number_changes_only_while_waiting(load, tmp_path):
    fmu = learner(load, tmp_path / "tape")
    ride(fmu, 1, ERRORS[:2])
    fmu.set("trip", 2)
    assert fmu.step(0.1) == ERROR
    assert "the trip number changed from 1 to 2 at trip_time = " in fmu.said


def test_a_trip_may_be_told_backwards(load, tmp_path):
    """What was recorded reaches from its first sample to its last, in whatever order they came."""
    fmu = learner(load, tmp_path / "native", tape_cutoff=1.0)
    told = [(0.5, 1.0), (0.4, 2.0), (0.3, -1.0), (0.6, 4.0)]
    for trip_time, error in told:
        fmu.set("trip_time", trip_time)
        fmu.set("error", error)
        assert fmu.step(0.1) == OK
    assert fmu.Terminate() == OK
    component = resolve(LEARNER)()
    slots = tuple(component.slots[n] for n in ("learned", "pair"))
    deck = TapeDeck("Learner", slots, component.present_values, sample_time=0.1, duration=1.0, cutoff=1.0)
    for trip_time, error in told:
        deck.record(trip_time, {"learned": 0.5 * error, "pair": np.full(2, 7.0 + 0.5 * abs(error))})
    deck.commit(lambda: True)
    deck.save(tmp_path / "python")
    assert (tmp_path / "native").read_bytes() == (tmp_path / "python").read_bytes()


def test_another_filter_before_the_first_step(load, tmp_path):
    """What has been prepared for the one of before makes way, though the tape is as long."""
    fmu = load(LEARNER).enter()
    for name, value in {"sample_time": 0.1, "tape_duration": 1.0, "tape_file": str(tmp_path / "native")}.items():
        fmu.set(name, value)
    assert fmu.get("command") == 0.0
    fmu.set("tape_cutoff", 0.05)
    assert fmu.ExitInitializationMode() == OK
    ride(fmu, 1, ERRORS)
    assert fmu.Terminate() == OK
    python_deck(ERRORS, 0.05).save(tmp_path / "python")
    assert (tmp_path / "native").read_bytes() == (tmp_path / "python").read_bytes()


def test_without_a_file_nothing_is_written(load, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fmu = load(LEARNER).initialize(sample_time=0.1, tape_duration=1.0)
    ride(fmu, 1, ERRORS)
    assert fmu.Terminate() == OK
    assert not list(tmp_path.iterdir())
