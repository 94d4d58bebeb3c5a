"""Algebraic loops: how they are solved at each point, and what is said of them."""

import json

import numpy as np
import pytest
from railcosim.orchestrator.cli import app as cli
from railcosim.orchestrator.errors import CouplingError, FmuError
from railcosim.orchestrator.fmi.binding.fmi2 import FmuSlave
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.algebraic.solver import LoopSolver
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System

EXPLICIT = pytest.mark.parametrize("algorithm", ["gauss-seidel", "jacobi"])


# -------------------------------------------------------------------- how it is solved


def affine(mine, gain, **how):
    """y = gain y + t through two blocks: y = t / (1 - gain)."""
    it = System(**{"stop_time": 1.0, "step": 0.25, "algebraic_loops": "solve"} | how)
    it.add("a", mine("Affine"), gain=gain)
    it.add("b", mine("Affine"))
    it.add("clock", mine("Clock"))
    it.connect("a.y", "b.u")
    it.connect("b.y", "a.u")
    it.connect("clock.t", "a.w")
    return it


@pytest.fixture
def ways(monkeypatch):
    """How often each of the two ways to slopes is taken, in Python."""
    monkeypatch.setattr(compiled, "kernel", None)
    count = {"directional": 0, "differences": 0}
    derive, differ = FmuSlave.directional_derivatives, LoopSolver._differences

    def directional(*arguments):
        count["directional"] += 1
        return derive(*arguments)

    def differences(*arguments, **rest):
        count["differences"] += 1
        return differ(*arguments, **rest)

    monkeypatch.setattr(FmuSlave, "directional_derivatives", directional)
    monkeypatch.setattr(LoopSolver, "_differences", differences)
    return count


@pytest.mark.parametrize("gain", [0.5, -3.0, 7.0])
def test_native_fmus_are_asked_for_their_slopes(mine, ways, gain):
    result = run(affine(mine, gain), kind="native")
    assert result["a.y"] == pytest.approx(result.time / (1.0 - gain), abs=1e-12)
    assert ways["directional"] >= 4
    assert ways["differences"] == 0


@pytest.mark.parametrize("kind", ["python", "plain"])
def test_others_are_asked_for_values_a_little_apart(mine, ways, kind):
    result = run(affine(mine, -3.0), kind=kind)
    assert result["a.y"] == pytest.approx(result.time / 4.0, abs=1e-9)
    assert ways["differences"] >= 4
    assert ways["directional"] == 0


def test_so_is_one_that_promised_slopes_and_gives_none(mine, ways, monkeypatch):
    def refuse(slave, *_):
        raise FmuError("no", instance=slave.name)

    monkeypatch.setattr(FmuSlave, "directional_derivatives", refuse)
    result = run(affine(mine, -3.0), kind="native")
    assert result["a.y"] == pytest.approx(result.time / 4.0, abs=1e-9)
    assert ways["differences"] >= 4


@pytest.mark.parametrize("kind", ["native", "plain"])
def test_initial_values_are_solved_both_ways(mine, ways, kind):
    """Where exchange diverges."""
    it = affine(mine, -3.0, start_time=2.0, stop_time=2.25, algebraic_loops="delay")
    assert run(it, kind=kind)["a.y"][0] == pytest.approx(0.5, abs=1e-9)
    assert (ways["directional"] > 0, ways["differences"] > 0) == (kind == "native", kind == "plain")


def test_scale_offset_and_units_are_part_of_the_loop(mine):
    """y = -3 (2 y + 1) + t."""
    it = affine(mine, -3.0)
    it.connections[1].scale, it.connections[1].offset = 2.0, 1.0
    result = run(it, kind="native")
    assert result["a.y"] == pytest.approx((result.time - 3.0) / 7.0, abs=1e-9)


@EXPLICIT
def test_what_depends_on_a_solution_follows_it(mine, algorithm):
    """A lag behind the loop is given the values that are solved at the begin of each step."""
    it = affine(mine, -3.0, algorithm=algorithm)
    it.add("lag", mine("Lag"), max_step=0.001)
    it.connect("a.y", "lag.u")
    result = run(it, kind="native")
    x = [1.0]
    for value in result["a.y"][:-1]:
        x.append(value + (x[-1] - value) * np.exp(-0.25))
    assert result["lag.x"] == pytest.approx(x, abs=1e-9)


@pytest.fixture
def strangers(foreign, xml):
    """Makes FMUs of another maker, and their variables."""
    return foreign, xml["variable"]


@EXPLICIT
@pytest.mark.parametrize("gain", [0.5, -3.0])
@pytest.mark.parametrize("listed", [True, False])
def test_fmus_without_state_access_and_lists_are_solved(strangers, mine, algorithm, gain, listed):
    """Without a list of dependencies the standard has an output depend on all inputs: with "solve" it is looked at."""
    foreign, v = strangers
    body = f"    def refresh(self, v):\n        v[2] = {gain} * v[0] + v[1]\n"
    known = {"dependencies": ["u", "w"]} if listed else {}
    it = System(stop_time=2.0, step=0.5, algorithm=algorithm, algebraic_loops="solve")
    variables = [v("u", "input", start=0.0), v("w", "input", start=0.0), v("y", "output", **known)]
    it.add("a", foreign(variables, body))
    it.add("clock", mine("Clock"))
    it.connect("clock.t", "a.w")
    it.connect("a.y", "a.u")
    result = run(it, kind="plain")
    assert result["a.y"] == pytest.approx(result.time / (1.0 - gain), abs=1e-9)
    assert result.coupling["algebraic_loop"]["signals"] == ["a.y"]


@EXPLICIT
def test_what_passes_on_at_once_into_the_loop_is_of_the_same_instant(mine, algorithm):
    """Two blocks stand between the clock and the loop: y = -3 y + 4 t."""
    it = affine(mine, -3.0, algorithm=algorithm)
    it.connections = [c for c in it.connections if c.source != "clock.t"]
    for name in ("first", "second"):
        it.add(name, mine("Affine"), gain=2.0)
    for source, target in (("clock.t", "first.u"), ("first.y", "second.u"), ("second.y", "a.w")):
        it.connect(source, target)
    result = run(it, kind="native")
    assert result["a.y"] == pytest.approx(result.time, abs=1e-12)


# -------------------------------------------------------------------- truth values


def switched(mine, level, upside_down=False, **how):
    """y = t, or 10 + t while y is above (below, upside down) a level."""
    it = System(**{"stop_time": 8.0, "step": 1.0, "algebraic_loops": "solve"} | how)
    it.add("switch", mine("Switch"))
    it.add("level", mine("Level"), level=level, upside_down=upside_down)
    it.add("clock", mine("Clock"))
    it.connect("clock.t", "switch.w")
    it.connect("switch.y", "level.u")
    it.connect("level.on", "switch.on")
    return it


@EXPLICIT
def test_a_loop_through_a_truth_value_is_solved(mine, algorithm):
    """The level is passed between 4 and 5 s: at 5 s and on all agree with each other."""
    result = run(switched(mine, 4.5, algorithm=algorithm), kind="native")
    on = np.arange(9) > 4.5
    assert list(result["level.on"]) == list(on)
    assert list(result["switch.y"]) == list(np.arange(9) + 10.0 * on)


@EXPLICIT
def test_a_loop_through_a_truth_value_without_solution_says_so(mine, algorithm):
    """On below 4.5 and 10 higher when on: no answer is right before 4.5 s. It starts delayed, with any."""
    it = switched(mine, 4.5, upside_down=True, algorithm=algorithm, start_time=5.0)
    assert run(it, kind="plain")["switch.y"][-1] == 8.0
    it.add("bend", mine("Affine"), gain=-1.0)  # from 5 s on: -t + 12, below the level at 8 s
    it.connections = [c for c in it.connections if c.target != "switch.w"]
    it.connect("clock.t", "bend.u", offset=-12.0)
    it.connect("bend.y", "switch.w")
    with pytest.raises(CouplingError) as caught:
        run(it, kind="plain")
    text = str(caught.value)
    assert text.startswith("t = 8 s: the algebraic loop through ")
    assert "switch.y" in text
    assert "level.on" in text


def test_a_loop_of_nothing_but_truth_values(mine):
    """Two that negate each other agree; where it was, it stays."""
    it = System(stop_time=3.0, step=1.0, algebraic_loops="solve")
    it.add("a", mine("Not"), u=True)
    it.add("b", mine("Not"))
    it.connect("a.y", "b.u")
    it.connect("b.y", "a.u")
    result = run(it, kind="native")
    assert [set(result["a.y"]), set(result["b.y"])] in ([{0.0}, {1.0}], [{1.0}, {0.0}])


# -------------------------------------------------------------------- what is said


@pytest.fixture
def file(mine, tmp_path):
    """A scenario file of the affine loop."""

    def write(gain, loops):
        path = tmp_path / "loop.toml"
        path.write_text(
            f"""
            [simulation]
            stop_time = 4.0
            algebraic_loops = "{loops}"
            [instances]
            a = {{ component = "{mine("Affine")}", start = {{ gain = {gain} }} }}
            b = {{ component = "{mine("Affine")}" }}
            clock = {{ component = "{mine("Clock")}" }}
            [connections]
            "a.u" = "b.y"
            "a.w" = "clock.t"
            "b.u" = "a.y"
            """,
            encoding="utf-8",
        )
        return str(path)

    return write


def command(capsys, *arguments):
    code = cli.call(arguments)
    told = capsys.readouterr()
    return code, told.out, told.err


def test_run_prints_the_residual(file, capsys, tmp_path):
    code, out, _ = command(capsys, "run", file(-3.0, "solve"), "--output", str(tmp_path / "out"), "--kind", "python")
    assert code == 0
    assert "algebraic loop through 2 signals: worst relative residual " in out
    assert float(out.split("worst relative residual ")[1].split()[0]) < 1e-9
    told = json.loads((tmp_path / "out" / "run.json").read_text())["coupling"]["algebraic_loop"]
    assert told["signals"] == ["a.y", "b.y"]
    assert (told["solutions"], told["worst_residual"] < 1e-9) == (40, True)


def test_check_prints_the_loop_and_what_becomes_of_it(file, capsys):
    code, out, _ = command(capsys, "check", file(-3.0, "delay"), "--trust")
    assert code == 0
    assert "note: algebraic loop through b.y, a.y: it is solved at initialization and acts one step late" in out
    assert "algebraic_loops = 'solve' solves it at each communication point" in out
    code, out, _ = command(capsys, "check", file(-3.0, "solve"), "--trust")
    assert "note: algebraic loop through b.y, a.y: it is solved at each communication point" in out


def test_run_says_that_a_delayed_loop_diverges(file, capsys, tmp_path):
    code, out, err = command(capsys, "run", file(-30.0, "delay"), "--output", str(tmp_path / "out"), "--kind", "python")
    text = " ".join((out + err).split())
    assert code == 0
    assert "diverging: the coupling through b.y, a.y diverges: it grows by a factor of " in text
    assert float(text.split("a factor of ")[1].split()[0]) == pytest.approx(30.0, rel=0.05)
    assert 'algebraic_loops = "solve"' in text
