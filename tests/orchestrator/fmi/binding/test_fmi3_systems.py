"""FMUs of FMI 3.0 in systems with those of other versions, and under validation."""

import math
from pathlib import Path

import numpy as np
import pytest
from railcosim.orchestrator import System, run
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.errors import FmuError, ScenarioError
from railcosim.orchestrator.fmi.models import load_fmu
from railcosim.orchestrator.linearization.closed_loop import linearize
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.validation import validate
from railcosim.orchestrator.validation.probing import PROBES

FOREIGN = Path(__file__).parents[2] / "foreign"
PART = 1.0 - math.exp(-0.25)


# -------------------------------------------------------------------- in systems


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_a_closed_loop_of_all_versions(by_hand, odd, algorithm):
    """Three lags in a ring: the recursion of the discrete system, to rounding."""
    system = System(stop_time=5.0, step=0.25, algorithm=algorithm, order=["a", "b", "c"])
    system.add("a", str(by_hand(1)), x=4.0)
    system.add("b", odd)
    system.add("c", str(by_hand(3)), x=-2.0)
    system.connect("a.x", "b.u")
    system.connect("b.x", "c.u")
    system.connect("c.x", "a.u", scale=-1.0, offset=0.5)
    result = run(system)
    a, b, c = 4.0, 0.0, -2.0
    expected = [[a, b, c]]
    for _ in range(20):
        if algorithm == "jacobi":
            a, b, c = a + PART * (0.5 - c - a), b + 0.25 * (a - b), c + PART * (b - c)
        else:
            a += PART * (0.5 - c - a)
            b += 0.25 * (a - b)
            c += PART * (b - c)
        expected.append([a, b, c])
    found = np.stack([result[f"{name}.x"] for name in "abc"], axis=1)
    assert np.abs(found - expected).max() < 1e-13


@pytest.mark.parametrize("isolate", [False, True])
def test_numbers_of_every_type_become_each_other(by_hand, odd, mine, isolate):
    """Reals by a threshold to whole numbers of 8 and 64 bits, to an item and to a truth value, and all of them back."""
    system = System(stop_time=2.0, step=0.25)
    system.add("course", mine("Course"), a=0.6, b=1.0)
    system.add("third", str(by_hand(3)))
    system.instances["third"].isolate = isolate
    for name in ("p", "q", "r"):
        system.add(name, mine("Pass"))
    system.connect("course.y", "third.ui8", scale=10.0, offset=4.0, threshold=0.5)
    system.connect("course.y", "third.i64", scale=3e9, threshold=0.0)
    system.connect("course.y", "third.gear", threshold=0.75)
    system.connect("course.y", "third.on", threshold=1.5)
    system.connect("third.uo8", "p.u", scale=0.1)
    system.connect("third.o64", "q.u")
    system.connect("third.off", "r.u", scale=-2.0, offset=1.0)
    system.stepping.order = ["course", "third", "p", "q", "r"]
    result = run(system)
    y = result["course.y"][1:]
    assert list(result["third.uo8"][1:]) == list(np.ceil(10.0 * y + 4.0 - 0.5))
    assert list(result["third.o64"][1:]) == list(np.ceil(3e9 * y))
    assert list(result["third.shown"][1:]) == list(np.ceil(y - 0.75))
    assert list(result["third.off"][1:]) == list((y <= 1.5).astype(int))
    assert result["p.y"] == pytest.approx(0.1 * result["third.uo8"], rel=1e-15)
    assert np.array_equal(result["q.y"], result["third.o64"].astype(float))
    assert np.array_equal(result["r.y"], 1.0 - 2.0 * result["third.off"])


def test_every_type_goes_from_version_to_version(by_hand, odd, components):
    """Whole numbers, booleans, texts and enumerations, through the three versions and a component of ours."""
    echo = components(
        "class Echo(Base):\n    word = Input('1', '')\n    again = Output('1', str)\n"
        "    def outputs(self):\n        return {'again': self.word + '!'}\n"
    )("Echo")
    system = System(stop_time=1.0, step=0.25, order=["first", "odd", "echo", "third"])
    system.add("first", str(by_hand(1)), n=41, gear="high", word="grüezi", on=False)
    system.add("odd", odd)
    system.add("third", str(by_hand(3)))
    system.add("echo", echo)
    for source, target in {
        "first.m": "odd.m",
        "odd.n": "third.i64",
        "first.off": "odd.on",
        "odd.off": "third.on",
        "first.shown": "third.gear",
        "first.said": "echo.word",
        "echo.again": "third.word",
        "first.y": "third.f",
    }.items():
        system.connect(source, target)
    result = run(system, kind="python")
    assert result["third.o64"][-1] == 43
    assert [result[f"{n}.off"][-1] for n in ("first", "odd", "third")] == [1, 0, 1]
    assert result["third.shown"][-1] == 3
    assert result["third.said"][-1] == "grüezi!"
    assert result["third.g"][-1] == np.float32(result["first.y"][-1])


def test_a_number_that_the_receiver_cannot_hold_stops_the_run(by_hand, odd):
    system = System(stop_time=1.0, step=0.25, order=["third", "odd"])
    system.add("third", str(by_hand(3)), i64=2**40)
    system.add("odd", odd)
    system.connect("third.o64", "odd.m")
    with pytest.raises(FmuError, match=r"^odd, t = \S+ s: 'm' cannot become 1099511627776: its type Integer holds"):
        run(system)


def test_start_values_are_checked_against_types(by_hand):
    system = System(stop_time=1.0, step=0.25)
    system.add("it", str(by_hand(3)), ui16=-1, ui8=201, ui64=2**64 - 1, i8=128, size=3, gear="high")
    with pytest.raises(ScenarioError) as caught:
        run(system)
    assert str(caught.value).splitlines() == [
        "it.ui16: takes a whole number from 0 to 65535, not -1",
        "it.ui8: 201 is above the limit 200",
        "it.i8: takes a whole number from -128 to 127, not 128",
        "it.size: it is a structural parameter: give it in build = { size = ... }",
    ]


def test_large_numbers_are_recorded(by_hand, tmp_path):
    system = System(stop_time=0.5, step=0.25)
    system.add("it", str(by_hand(3)), ui64=2**64 - 1, gear="high")
    result = run(system, output=tmp_path / "results", figures=False)
    assert result["it.uo64"][-1] == float(2**64 - 1)
    assert result["it.shown"][-1] == 5e9


def test_what_is_not_finite_is_blamed_on_its_source(by_hand):
    system = System(stop_time=6.0, step=0.25)
    system.add("it", str(by_hand(3)), mode=12)
    with pytest.raises(FmuError, match=r"^it, t = 5 s: output 'y' is nan$"):
        run(system)


def test_units_are_converted(by_hand):
    path = str(by_hand(3, ('name="x" valueReference="2" causality="output" initial="exact" unit="m"',
                           'name="x" valueReference="2" causality="output" initial="exact" unit="km"')))  # fmt: skip
    system = System(stop_time=0.25, step=0.25)
    system.add("a", path, x=0.5)
    system.add("b", path)
    system.connect("a.x", "b.u")
    result = run(system)
    assert result["b.y"][0] == 501.0


@pytest.mark.parametrize("algorithm", ["iterative", "adaptive"])
def test_algorithms_that_come_back_to_saved_states(by_hand, algorithm):
    """Two lags in a ring: implicit coupling against its recursion, a controlled error against the exact solution."""
    path = str(by_hand(3))
    system = System(stop_time=2.0, step=0.25, algorithm=algorithm, record=0.25)
    system.add("a", path, x=4.0)
    system.add("b", path, x=-2.0)
    system.connect("a.x", "b.u")
    system.connect("b.x", "a.u", scale=-1.0)
    result = run(system)
    found = np.array([result["a.x"], result["b.x"]])
    if algorithm == "iterative":
        past, gain = np.eye(2) * (1.0 - PART), PART * np.array([[0.0, -1.0], [1.0, 0.0]])
        step, worst = np.linalg.solve(np.eye(2) - gain, past), 1e-6
    else:
        step, worst = (
            math.exp(-0.25) * np.array([[math.cos(0.25), -math.sin(0.25)], [math.sin(0.25), math.cos(0.25)]]),
            0.05,
        )
    expected = np.array([4.0, -2.0])
    for k in range(9):
        assert np.abs(found[:, k] - expected).max() < worst
        expected = step @ expected


def test_algorithms_refuse_what_cannot_save_its_state(by_hand):
    system = System(stop_time=2.0, step=0.25, algorithm="adaptive")
    system.add("a", str(by_hand(1)))
    with pytest.raises(ScenarioError, match=r"^a: the state that adaptive comes back to cannot be saved"):
        run(system)


def test_a_bad_description_of_the_sources_is_no_reason(xml, tmp_path, workspace):
    files = {
        "modelDescription.xml": FOREIGN.joinpath("fmi3.xml").read_text(encoding="utf-8"),
        "sources/buildDescription.xml": "<nonsense/>",
    }
    assert load_fmu(xml["write_archive"](tmp_path / "it.fmu", files), workspace).interface.model == "Third"


def test_notes_name_what_is_left_out(by_hand, workspace):
    system = System(stop_time=1.0, step=0.25)
    system.add("it", str(by_hand(3)))
    assert any("are left out: tick (a clock)" in note for note in check(system, workspace).notes)


@pytest.mark.parametrize("derivatives", [True, False])
def test_linearize(by_hand, derivatives):
    """By its directional derivatives, or by finite differences from saved states."""
    changes = [] if derivatives else [("providesDirectionalDerivatives", "providesNone")]
    system = System(stop_time=1.0, step=0.25)
    system.add("it", str(by_hand(3, *changes)), gain=2.0)
    found = linearize(system, 0.5, inputs=["it.u"], outputs=["it.y"])
    assert found.states == ("it.x",)
    expected = ([[-1.0]], [[1.0]], [[1.0]], [[2.0]]) if derivatives else ([[1.0 - PART]], [[PART]])
    for matrix, value in zip((found.a, found.b, found.c, found.d), expected, strict=False):
        assert np.allclose(matrix, value, atol=1e-9)


def test_pack_refuses_it_in_a_sentence(by_hand, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "one.toml").write_text(
        f'[simulation]\nstep = 0.25\nstop_time = 1.0\n[instances.it]\nfmu = "{by_hand(3)}"\n', encoding="utf-8"
    )
    assert call(["pack", "one.toml", "-o", "it.fmu"]) == 2
    assert "it: Third is FMI 3.0; only FMI 2.0 is packed" in capsys.readouterr().err


# -------------------------------------------------------------------- validate


@pytest.mark.parametrize("version", [1, 3])
def test_validate(by_hand, version):
    report = validate(by_hand(version, options=["-DRESET=0"]))
    found = {finding.check: (finding.verdict, finding.detail) for finding in report.findings}
    assert report.passed, found
    assert found["schema"] == ("pass", f"modelDescription.xml keeps the schema of FMI {version}.0")
    assert (
        found[PROBES["simulate"]][1]
        == f"20 steps of {0.1 if version == 1 else 0.25} s, {8 if version == 1 else 15} outputs finite"
    )
    assert found[PROBES["instances"]][0] == "pass"
    assert found[PROBES["state"]][0] == ("skipped" if version == 1 else "pass")
    assert found[PROBES["reset"]][0] == "pass"
    assert found[PROBES["order"]][0] == ("skipped" if version == 1 else "warning")


def test_validate_gives_an_fmu_its_event_mode(by_hand):
    """One that insists on it: steps end at its events, which are handled before the rest is taken."""
    path = by_hand(3, ("<CoSimulation", '<CoSimulation hasEventMode="true"'), options=["-DEVENTS=1", "-DRESET=0"])
    report = validate(path)
    found = {finding.check: (finding.verdict, finding.detail) for finding in report.findings}
    assert report.passed, found
    assert found[PROBES["simulate"]] == ("pass", "20 steps of 0.25 s, 15 outputs finite")
    assert [found[PROBES[probe]][0] for probe in ("instances", "state", "steps")] == ["pass"] * 3


def test_validate_finds_what_is_wrong(by_hand):
    path = by_hand(3, ('variability="tunable" start="1"', 'variability="tunable" start="2"'), library="other")
    found = {finding.check: (finding.verdict, finding.detail) for finding in validate(path).findings}
    assert found["binary"][0] == "fail"
    assert "other.so is not named after the model identifier 'Third'" in found["binary"][1]
    assert found[PROBES["starts"]] == ("fail", "gain starts at 1.0, not at 2.0 as described")
