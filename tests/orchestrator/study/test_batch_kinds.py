"""FMUs of other makers in a batch: reset where that does, made anew where it does not, and each row a single run."""

import numpy as np
import pytest
from railcosim.orchestrator import Batch, Event, System
from railcosim.orchestrator.fmi import Workspace
from railcosim.orchestrator.run import Repeater, execute, listening
from railcosim.orchestrator.run import check as check_system
from railcosim.orchestrator.scenario import changed

from .test_batch import agree

GAINS = [1.0, 2.0, 0.5, 1.0]


def of(path, record, **keys):
    """A system of one FMU."""
    system = System(step=0.25, stop_time=keys.pop("stop_time", 2.0), metrics={"end": f"final(it.{record})"})
    system.add("it", str(path), **keys)
    return system


def check(system, runs, record, **options):
    """Run a batch to and fro; its notes."""
    singles = [execute(changed(system, changes), **options) for changes in runs]
    with Batch(system, record=[record], **options) as batch:
        for k in (*range(len(runs)), *reversed(range(len(runs)))):
            agree(batch.run(runs[k]), singles[k])
        return batch.notes


@pytest.mark.parametrize("version", [1, 3])
@pytest.mark.parametrize(
    ("options", "note"),
    [
        (("-DRESET=0",), ""),
        (("-DRESET=3",), "status error: fmi"),
        ((), "its library has no function fmi"),
    ],
)
def test_resets_of_other_versions(by_hand, version, options, note):
    system = of(by_hand(version, options=options), "x", gain=3.0, u=0.5)
    notes = [x for x in check(system, [{"it.gain": gain} for gain in GAINS], "it.y") if "anew" in x]
    assert len(notes) == bool(note)
    assert all(note in x for x in notes)


def test_a_reset_that_leaves_something_behind_is_found_out(lag):
    """It comes back to its initial state but for its parameter, which another run does not set."""
    kept = "M->phase = 0; return fmi2OK;"
    runs = [{"it.k": 2.0}, {}, {"it.k": 3.0}, {}]
    assert not [x for x in check(of(lag(on_reset=kept), "y"), runs, "it.y") if "anew" in x]  # never trusted with that
    leaks = "static double left; left += 0.125; M->phase = 0; M->u = left; M->k = 1.0; return fmi2OK;"
    notes = check(of(lag(on_reset=leaks), "y"), runs, "it.y")
    assert "it (Lag) is not after a reset what a new instance is: it is instantiated anew for every run" in notes


def test_a_reset_that_does_is_tried_once(lag, tmp_path):
    calls = tmp_path / "calls"
    code = {name: f'{{ FILE *f = fopen("{calls}", "a"); fputs("{text} ", f); fclose(f); }}' for name, text in
            (("on_instantiate", "new"), ("on_reset", "reset"), ("on_free", "free"))}  # fmt: skip
    with Batch(of(lag(options=("-include", "stdio.h"), **code), "y")) as batch:
        batch.run_all([{"it.k": k} for k in GAINS])
    assert calls.read_text().split() == ["new", "reset", "free", "new", "reset", "reset", "free"]


def test_what_fails_in_the_middle_is_nothing_to_the_next_run(by_hand):
    system = of(by_hand(1, options=("-DRESET=0",)), "x", stop_time=8.0)
    runs = [{"it.mode": mode} for mode in (0, 3, 0, 2, 4, 0)]  # from 5 s on: an error, a discarded step, a fatal error
    check(system, runs, "it.y")


def test_an_fmu_of_this_house_in_a_process_of_its_own(mine):
    system = System(step=0.25, stop_time=1.0, metrics={"end": "final(it.x)"})
    system.add("it", mine("Lag"), rate=2.0).isolate = True
    notes = check(system, [{"it.rate": rate} for rate in GAINS[:2]], "it.x")
    assert not [x for x in notes if "anew" in x]


def test_of_those_that_share_a_process_one_is_made_anew(lag):
    """It cannot be reset with a start value less; the others stay where they are."""
    system = System(step=0.25, stop_time=1.0, metrics={"end": "final(a.y)"})
    for name in "ab":
        system.add(name, str(lag())).isolate = "together"
    check(system, [{"a.k": 2.0, "b.k": 3.0}, {"b.k": 1.0}, {"a.k": 3.0, "b.k": 2.0}, {}], "a.y")


def test_a_crash_in_a_process_of_its_own_is_a_row(lag):
    system = of(lag(on_step="if (M->k == 2.0 && t > 0.9) abort();"), "y")
    system.instances["it"].isolate = True
    with Batch(system) as batch:
        found = batch.run_all([{"it.k": k} for k in (1.0, 2.0, 1.0, 3.0)])
    assert list(found.status) == ["completed", "failed", "completed", "completed"]
    assert "SIGABRT" in found.error[1]
    assert found.metrics["end"][0] == found.metrics["end"][2]


def test_an_fmu_that_would_end_the_process_is_a_row(hostile):
    system = System(step=0.1, stop_time=1.0, metrics={"end": "final(bad.calls)"})
    system.add("bad", str(hostile()))
    deeds = ["step exit 0.3", "", "get abort 0.3", "step exit 0.3", ""]
    with Batch(system) as batch:
        found = batch.run_all([{"bad.deed": deed} for deed in deeds])
    assert list(found.status) == ["completed" if not deed else "failed" for deed in deeds]
    # The same whatever was run before, though the library of an instance that was lost stays loaded.
    assert found.error[0] == "bad, t = 0.3 s: fmi2DoStep called exit(7), which would have ended the process"
    assert found.error[2] == "bad, t = 0.3 s: fmi2GetReal called abort(), which would have ended the process"
    assert found.error[3] == found.error[0]
    assert found.metrics["end"][1] == found.metrics["end"][4] == 10.0


def test_what_an_fmu_does_to_its_process_is_told(lag):
    with Batch(of(lag(on_step='setenv("FOUND", "it", 1);'), "y")) as batch:
        batch.run()
    assert any("FOUND" in note for note in batch.notes)


@pytest.mark.parametrize("algorithm", ["jacobi", "iterative", "adaptive"])
def test_algorithms_begin_anew(mine, algorithm):
    system = System(step=0.25, stop_time=1.0, record=0.5, algorithm=algorithm, metrics={"most": "max(b.x)"})
    system.add("a", mine("Lag"), rate=2.0)
    system.add("b", mine("Lag"))
    system.connect("a.x", "b.u")
    system.connect("b.x", "a.u")
    check(system, [{"a.rate": rate} for rate in GAINS], "a.x", kind="plain")


def test_a_coupling_that_diverges_is_told_as_of_a_single_run(mine):
    system = System(step=1.0, stop_time=400.0, metrics={"most": "max(b.y)"})
    for name in ("a", "b"):
        system.add(name, mine("Affine"))
    system.connect("a.y", "b.u", scale=-3.0)
    system.connect("b.y", "a.u", scale=3.0)
    system.instances["a"].start["w"] = 1.0
    assert "diverges" in str(execute(system, kind="plain").error)
    check(system, [{}, {"a.w": 0.5}], "a.y", kind="plain")
    system.stepping.record = 2.0
    check(system, [{}, {"a.w": 0.5}], "a.y", kind="plain")


def test_what_speaks_of_a_value_that_a_swapped_model_lacks_is_judged(mine):
    system = System(step=0.25, stop_time=1.0, metrics={"share": "final(it.x) / it.gain"})
    system.judged.requirements["below"] = "always it.x <= it.gain"
    system.add("it", mine("LagWithSlope"), gain=2.0).swapped = True
    check(system, [{"it.gain": gain} for gain in GAINS], "it.x", kind="plain")


def test_texts_and_wholes_keep_their_types(by_hand):
    system = of(by_hand(1, options=("-DRESET=0",)), "x", word="one")
    with Batch(system, record=["it.said", "it.m"]) as batch:
        row = batch.run({"it.n": 3})
        row = batch.run({"it.n": 4})
    single = execute(changed(system, {"it.n": 4}))
    for name in ("it.said", "it.m"):
        np.testing.assert_array_equal(row.series[name], single[name])
        assert row.series[name].dtype == single[name].dtype


def test_one_that_is_restored_after_steps_that_it_discards(lag, lag_description):
    able = lag_description.replace("<CoSimulation ", '<CoSimulation canHandleVariableCommunicationStepSize="true" ')
    system = of(lag(able, on_step="if (h > 0.2) return fmi2Discard;"), "y")
    check(system, [{"it.k": k} for k in GAINS], "it.y")


def test_one_that_cannot_begin_after_a_reset_is_made_anew(lag):
    notes = check(of(lag(on_reset="M->phase = 1; return fmi2OK;"), "y"), [{"it.k": k} for k in GAINS[:3]], "it.y")
    assert sum("instantiated anew" in note for note in notes) == 1


def test_events_are_values_too(lag):
    system = of(lag(), "y")
    system.events = [Event("it.y", "bias", 0.5, 1.0, duration=0.5), Event("it.u", "set", 1.0, 2.0)]
    check(system, [{}, {"events[1].value": 3.0}, {"events[2].at": 0.25, "events[1].duration": 0.25}], "it.y")


def test_a_trial_that_is_interrupted_proves_nothing(lag):
    class Asking:
        """Asks for the end while new instances run that those which were reset are compared with."""

        @property
        def is_asked_for(self):
            return repeater.crew.is_trial and not repeater.crew.untried

    with Workspace() as workspace:
        checked = check_system(of(lag(), "y"), workspace)
        repeater = Repeater(checked, [])
        with listening() as nobody:
            first = repeater.fly(checked, nobody)
            assert repeater.fly(checked, Asking()) is None
            second = repeater.fly(checked, nobody)
        repeater.crew.dismiss()
    assert second.seen.time.tolist() == first.seen.time.tolist()
    assert second.seen["it.y"].tolist() == first.seen["it.y"].tolist()
    assert not repeater.crew.notes
