"""Steps as long as a tolerance lets them be: what is refused, how steps are chosen, what is kept and given back."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.orchestrator.errors import CouplingError, FmuError, ScenarioError
from railcosim.orchestrator.fmi.binding.loaded import LoadedSlave
from railcosim.orchestrator.master import compiled
from railcosim.orchestrator.master.algorithms.adaptive import _fit
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.run.execution import execute, run
from railcosim.orchestrator.system import Event, System


def swing(mine, **how):
    """x'' = -x in two FMUs."""
    it = System(**{"stop_time": 5.0, "step": 1.0, "algorithm": "adaptive"} | how)
    it.add("spring", mine("Spring"))
    it.add("mass", mine("Mass"), max_step=0.01)
    it.connect("mass.x", "spring.x")
    it.connect("spring.a", "mass.a")
    return it


# -------------------------------------------------------------------- what is refused


def refused(it, workspace, kind="plain"):
    with pytest.raises(ScenarioError) as caught:
        check(it, workspace, kind)
    return str(caught.value)


def test_sampled_components_are_refused(mine, workspace):
    it = swing(mine)
    it.add("counter", mine("Count"))
    told = refused(it, workspace)
    assert told.startswith(
        "counter: sampled at points of its own, which adaptive cannot step over; choose gauss-seidel"
    )


@pytest.mark.parametrize(
    ("capabilities", "told"),
    [
        (
            'canHandleVariableCommunicationStepSize="true"',
            "a, b: the state that adaptive comes back to cannot be saved",
        ),
        ('canGetAndSetFMUstate="true"', "a, b: the step cannot vary"),
    ],
)
def test_fmus_that_cannot_are_named(foreign, xml, workspace, capabilities, told):
    path = foreign([xml["variable"]("y", "output")], simulation=capabilities)
    it = System(stop_time=1.0, step=0.1, algorithm="adaptive")
    it.add("a", path)
    it.add("b", path)
    assert refused(it, workspace).startswith(told)


def test_of_many_only_some_are_named(foreign, xml, workspace):
    it = System(stop_time=1.0, step=0.1, algorithm="adaptive")
    path = foreign([xml["variable"]("y", "output")], simulation='canHandleVariableCommunicationStepSize="true"')
    for k in range(9):
        it.add(f"a{k}", path)
    assert "a4, a5 and 3 more: the state" in refused(it, workspace)


def test_delays_steps_of_one_s_own_and_records_of_nothing_are_refused(mine, workspace):
    it = swing(mine)
    it.connections[1].delay = 1
    assert refused(it, workspace).startswith("mass.a: a delay counts communication points, which adaptive sets anew")
    it = swing(mine)
    it.instances["mass"].step = 2.0
    assert "mass has a step of its own, which goes with gauss-seidel and jacobi only" in refused(it, workspace)
    for record in (0.0, -0.5, math.inf):
        assert f"record must be a positive number, not {record!r} s" in refused(swing(mine, record=record), workspace)


def test_min_step_is_for_adaptive(mine, workspace):
    told = refused(swing(mine, algorithm="jacobi", min_step=0.1), workspace)
    assert told == "simulation.min_step is for adaptive; the algorithm is jacobi"


def test_a_tolerance_that_has_no_effect_is_noted(foreign, xml, workspace):
    """Of what is no continuous number nobody can say how wrong it is."""
    able = 'canGetAndSetFMUstate="true" canHandleVariableCommunicationStepSize="true"'
    shown = [xml["variable"]("n", "output", variability="discrete"), xml["variable"]("y", "output")]
    it = System(stop_time=1.0, step=0.1, algorithm="adaptive", tolerances={"a.n": [0.0, 1e-9], "a.y": [0.0, 1e-3]})
    it.add("a", foreign(shown, simulation=able))
    notes = check(it, workspace).notes
    assert "the tolerance of a.n has no effect: adaptive watches continuous outputs" in notes
    assert not any("a.y" in note for note in notes)


# -------------------------------------------------------------------- how steps are chosen


@settings(max_examples=300, deadline=None)
@given(st.floats(0.0, 1e3), st.floats(1e-6, 10.0), st.floats(1e-6, 100.0))
def test_a_step_lands_where_it_must_and_leaves_no_tiny_rest(time, wanted, left):
    until = time + left
    end, length = _fit(time, wanted, until)
    assert time < end <= until
    assert length == pytest.approx(end - time, rel=1e-9, abs=1e-9)
    assert length <= wanted * (1.0 + 1e-6)
    if end < until:
        assert until - end >= 0.5 * wanted * (1.0 - 1e-6) - 1e-9


def test_steps_grow_and_shrink_with_the_error(mine):
    """Not by more than five times, and to at most the system's step."""
    result = run(swing(mine, tolerance=1e-4), kind="plain")
    lengths = np.diff(result.time)
    told = result.coupling["adaptive"]
    assert (told["accepted"], told["shortest_step"]) == (len(lengths), pytest.approx(lengths.min(), rel=1e-9))
    assert told["longest_step"] == pytest.approx(lengths.max(), rel=1e-9)
    assert lengths.max() < 0.2
    assert told["rejected"] >= 2  # it begins with the longest step, which is too long
    ratios = lengths[1:] / lengths[:-1]
    assert ratios.max() <= 5.0 * (1.0 + 1e-9)
    assert np.abs(result["mass.x"] - np.cos(result.time)).max() < 0.03


def test_nothing_to_control_takes_the_longest_steps(mine):
    """A spring without stiffness."""
    it = swing(mine)
    it.instances["spring"].start["stiffness"] = 0.0
    assert list(run(it, kind="plain").time) == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]


def test_a_stop_time_between_steps_is_met(mine):
    it = swing(mine, stop_time=2.3)
    it.instances["spring"].start["stiffness"] = 0.0
    assert list(run(it, kind="plain").time) == [0.0, 1.0, pytest.approx(1.65), 2.3]


@pytest.mark.parametrize("record", [0.04, 0.3, 1.0, 0.7])
def test_rows_are_where_record_wants_them_and_at_the_end(mine, record):
    """Also where rounding would leave a rest of a step of 1e-16 s."""
    result = run(swing(mine, stop_time=1.6, record=record, tolerance=1e-3), kind="plain")
    grid = np.arange(0.0, 1.6 - 1e-9, record)
    assert result.time == pytest.approx([*grid, 1.6], abs=1e-12)
    assert result.time[-1] == 1.6


def test_an_event_is_landed_on(mine):
    """Without it the mass rests."""
    it = swing(mine, stop_time=2.0)
    it.instances["spring"].start["stiffness"] = 0.0
    it.events = [Event("spring.a", "bias", at=0.37, value=1.0)]
    result = run(it, kind="plain")
    assert 0.37 in result.time
    assert result["mass.x"] == pytest.approx(1.0 + 0.5 * np.maximum(0.0, result.time - 0.37) ** 2, abs=1e-9)


@pytest.mark.parametrize("at", [0.55, 0.75, 0.9, 0.99])
def test_what_happens_in_the_last_half_of_a_step_is_seen(mine, at):
    """An input that jumps within a step: the integral is late by no more than the tolerance."""
    it = System(stop_time=2.0, step=1.0, algorithm="adaptive", tolerance=1e-3)
    it.add("wall", mine("Wall"), at=at)
    it.add("sum", mine("Integral"))
    it.connect("wall.y", "sum.u")
    result = run(it, kind="plain")
    assert result["sum.x"][-1] == pytest.approx(2.0 - at, abs=5e-3)
    assert result.coupling["adaptive"]["rejected"] > 2


def test_a_jump_is_passed_in_a_shortest_step_and_told(mine):
    """What no step resolves within the tolerance is not stepped at for ever, and what follows is smooth again."""
    it = System(stop_time=4.0, step=1.0, algorithm="adaptive", tolerance=1e-9)
    it.add("wall", mine("Wall"), at=1.3)
    it.add("sum", mine("Integral"))
    it.connect("wall.y", "sum.u")
    result = run(it, kind="plain")
    assert result["sum.x"][-1] == pytest.approx(2.7, abs=2e-6)
    told = result.coupling["adaptive"]
    assert told["jumps"] == 1
    assert told["first_jumps"] == [{"time": pytest.approx(1.3, abs=2e-6), "signal": "sum.x"}]
    assert told["summary"].endswith("; 1 jump, each passed in a shortest step")
    assert told["accepted"] < 60


@pytest.mark.parametrize("min_step", [None, 1e-9, 1.33e-6])
def test_the_shortest_step_has_two_halves_at_calendar_times_too(mine, min_step):
    """Seconds since 1970 are 2.4e-7 s apart, and the shortest step is not whole of those."""
    begin = 1.7e9
    how = {"algorithm": "adaptive", "tolerance": 1e-12} | ({} if min_step is None else {"min_step": min_step})
    it = System(start_time=begin, stop_time=begin + 0.4, step=0.1, **how)
    it.add("wall", mine("Wall"), at=begin + 0.13)
    it.add("sum", mine("Integral"))
    it.connect("wall.y", "sum.u")
    result = run(it, kind="plain")
    assert result["sum.x"][-1] == pytest.approx(0.27, abs=5e-6)
    told = result.coupling["adaptive"]
    assert told["jumps"] == 1
    assert told["shortest_step"] >= 4.0 * math.ulp(begin)


def test_a_step_that_an_fmu_fails_in_is_tried_shorter(mine):
    """From x = 1 down to exp(-t): a step of 2 s would end below nought."""
    it = System(stop_time=4.0, step=2.0, algorithm="adaptive", tolerance=1e-3)
    it.add("fragile", mine("Fragile"))
    it.add("follow", mine("Pass"), u=1.0)
    it.connect("fragile.x", "follow.u")
    it.connect("follow.y", "fragile.u")
    for kind in ("plain", "native"):
        result = run(it, kind=kind)
        assert result["fragile.x"] == pytest.approx(np.exp(-result.time), abs=0.02)
        assert result.coupling["adaptive"]["rejected"] >= 1


def test_one_that_fails_in_the_shortest_step_too_says_why(mine):
    it = System(stop_time=4.0, step=2.0, algorithm="adaptive", min_step=0.5)
    it.add("fragile", mine("Fragile"), gain=3.0)
    with pytest.raises(FmuError) as caught:
        run(it, kind="plain")
    assert "math domain error" in str(caught.value)


def test_a_tolerance_that_cannot_be_kept_says_where_and_what_to_do(mine):
    with pytest.raises(CouplingError) as caught:
        run(swing(mine, tolerances={"mass.v": [0.0, 1e-6]}, min_step=0.01), kind="plain")
    text = str(caught.value)
    assert ": mass.v cannot be kept within its tolerance (0 relative, 1e-06 absolute): its error is " in text
    assert "at the shortest step, 0.01 s; loosen simulation.tolerance, or this signal's in [simulation." in text
    assert "allow a smaller simulation.min_step" in text


# -------------------------------------------------------------------- what is kept


@pytest.mark.parametrize("fails", [False, True])
def test_saved_states_are_given_back(mine, monkeypatch, fails):
    """Two points a step, its begin and its end, and of a rejected one as well."""
    kept, most = [], 0
    save, forget = LoadedSlave.save, LoadedSlave.forget

    def note(slave):
        nonlocal most
        kept.append(slave.name)
        most = max(most, len(kept))
        return save(slave)

    monkeypatch.setattr(LoadedSlave, "save", note)
    monkeypatch.setattr(LoadedSlave, "forget", lambda s, state: kept.remove(s.name) or forget(s, state))
    monkeypatch.setattr(compiled, "kernel", None)
    how = {"tolerance": 1e-9, "min_step": 0.1} if fails else {}
    outcome = execute(swing(mine, **how), kind="native")
    assert outcome.status == ("failed" if fails else "completed")
    assert most > 0
    assert kept == []


def test_the_record_tells_how_it_went(mine, tmp_path):
    outcome = run(swing(mine), kind="plain", output=tmp_path)
    told = json.loads((tmp_path / "run.json").read_text())
    assert told["coupling"]["adaptive"] == outcome.coupling["adaptive"]
    assert told["algorithm"] == "adaptive"
    assert told["order"] == ["spring", "mass"]


# -------------------------------------------------------------------- rows of uneven distance


def test_metrics_weigh_rows_by_time(mine):
    """Over two periods of cos(t), whose rows crowd where it bends: means of the points would be off by far."""
    metrics = {
        "mean": "mean(mass.x)",
        "rms": "rms(mass.x)",
        "area": "integral(mass.v, until = 3.14159265358979)",
        "above": "duration(mass.x > 0)",
        "settled": "settling_time(mass.x - 1, 1.5)",
        "jerk": "jerk(mass.v)",
        "at": "at(mass.x, 6.0)",
    }
    end = 4.0 * math.pi
    it = swing(mine, stop_time=end, tolerance=1e-5, metrics=metrics, tolerances={"mass.x": [3e-3, 1e-7]})
    result = run(it, kind="plain")
    assert np.ptp(np.diff(result.time)) > 0.3 * np.diff(result.time).mean()
    found = {metric.name: metric.values[None] for metric in result.metrics}
    assert found["mean"] == pytest.approx(0.0, abs=0.01)
    assert found["rms"] == pytest.approx(math.sqrt(0.5), abs=0.01)
    assert found["area"] == pytest.approx(-2.0, abs=0.05)
    assert found["above"] == pytest.approx(2.0 * math.pi, abs=0.1)
    assert found["settled"] == pytest.approx(10.0 / 3.0 * math.pi, abs=0.3)
    assert found["jerk"] == pytest.approx(1.0, abs=0.05)
    assert found["at"] == pytest.approx(math.cos(6.0), abs=0.01)
    assert abs(np.mean(result["mass.x"])) > 2.0 * abs(found["mean"])
