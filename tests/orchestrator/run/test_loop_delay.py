"""How late a force acts is counted along the connections, and held against what the controller believes."""

from pathlib import Path

import pytest
from railcosim.orchestrator import System, load
from railcosim.orchestrator.run.checking import check, describe_stepping
from railcosim.orchestrator.run.loop_delay import loop_delays

TOYS = Path(__file__).parents[2] / "toys.py"


def ato(*, protected=True, sensed=False, algorithm="jacobi", step=0.01, **how):
    """A learning controller on its train, by a protection and a sensor or without."""
    system = System(stop_time=1.0, step=step, algorithm=algorithm, **how)
    system.add("timetable", "Timetable", sample_time=step)
    system.add("ato", "Cailc", sample_time=step)
    system.add("train", "SubwayTrain")
    for name in ("trip", "trip_time"):
        system.connect(f"timetable.{name}", f"ato.{name}")
        system.connect(f"timetable.{name}", f"train.{name}")
    for name in ("position", "speed", "acceleration"):
        system.connect(f"timetable.reference_{name}", f"ato.reference_{name}")
    source = "train"
    if sensed:
        system.add("sensor", "Sensor")
        source = "sensor"
    for name in ("position", "speed"):
        if sensed:
            system.connect(f"train.{name}", f"sensor.true_{name}")
        system.connect(f"{source}.{name}", f"ato.{name}")
    if protected:
        system.add("protection", "Protection")
        for name in ("position", "speed"):
            system.connect(f"train.{name}", f"protection.{name}")
        system.connect("timetable.trip_time", "protection.trip_time")
        system.connect("ato.force", "protection.demanded_force")
    system.connect(f"{'protection' if protected else 'ato'}.force", "train.force")
    return system


@pytest.fixture
def found(workspace):
    def find(system):
        checked = check(system, workspace, "plain")
        interfaces = {name: model.interface for name, model in checked.models.items()}
        return loop_delays(checked.system, interfaces, checked.wiring, checked.order.sequence)

    return find


@pytest.mark.parametrize(
    ("how", "steps"),
    [
        ({"protected": False}, 1),
        ({}, 2),
        ({"sensed": True}, 3),
        ({"algorithm": "gauss-seidel"}, 0),
        ({"algorithm": "gauss-seidel", "sensed": True}, 0),
        ({"algorithm": "gauss-seidel", "order": ["protection", "ato", "train", "timetable"]}, 1),
        ({"algorithm": "gauss-seidel", "order": ["train", "ato", "protection", "timetable"]}, 0),
        ({"algorithm": "gauss-seidel", "order": ["train", "ato", "timetable"], "protected": False}, 0),
    ],
)
def test_each_output_that_passes_something_on_costs_a_step(found, how, steps):
    """Not where the order of a sweep spares it; a train that steps first gives the end of the step at its begin."""
    (delay,) = found(ato(**how))
    assert (delay.steps, delay.samples) == (steps, steps)


def test_a_delay_on_purpose_counts(found):
    system = ato(algorithm="gauss-seidel")
    next(c for c in system.connections if c.target == "train.force").delay = 3
    assert found(system)[0].steps == 3


def test_samples_may_be_shorter_than_steps(found):
    """Two steps of 0.01 s are four samples of 5 ms, more than the controller can be told."""
    system = ato()
    system.instances["ato"].start["sample_time"] = 0.005
    (delay,) = found(system)
    assert (delay.steps, delay.samples) == (2, 4)
    assert "set ato.delay = 4 (which takes 2 at most) with timetable.preview = 4" in str(delay)


@pytest.mark.parametrize(("preview", "wanted"), [(5, {}), (2, {}), (1, {"timetable.preview": 2})])
def test_a_preview_may_be_longer_than_the_delay_where_a_drive_may_lag(found, preview, wanted):
    """Shorter it may not be; and without anything between controller and train it is that of the delay."""
    system = ato()
    system.instances["timetable"].start["preview"] = preview
    system.instances["ato"].start["delay"] = 2
    (delay,) = found(system)
    assert delay.wanted == wanted
    direct = ato(protected=False)
    direct.instances["timetable"].start["preview"] = preview
    (delay,) = found(direct)
    assert delay.wanted.get("timetable.preview", preview) == 1


def test_it_is_told_what_to_set(workspace):
    (told,) = [note for note in check(ato(), workspace, "plain").notes if "acts on train" in note]
    assert told == (
        "ato.force acts on train 2 communication steps late (ato.force, protection.force come late), which ato.delay = "
        "0 with timetable.preview = 0 does not have so: set ato.delay = 2 with timetable.preview = 2"
    )
    system = ato()
    system.instances["ato"].start["delay"] = system.instances["timetable"].start["preview"] = 2
    checked = check(system, workspace, "plain")
    assert not any("acts on train" in note for note in checked.notes)
    (told,) = [line for line in describe_stepping(checked) if "acts on train" in line]
    assert told.endswith("come late), as ato.delay = 2 with timetable.preview = 2 has it")


@pytest.mark.parametrize(("preset", "late"), [(None, False), ("late-exchange", True)])
def test_controllers_that_only_know_whether(found, preset, late):
    delays = found(load("fault_tolerant_cruise", preset=preset))
    assert [delay.said for delay in delays] == [{f"cruise[{i}].late_action": late} for i in (1, 2, 3)]
    assert not any(delay.wanted for delay in delays)
    (first, *_) = found(load("fault_tolerant_cruise", preset=preset, algorithm="gauss-seidel" if late else "jacobi"))
    assert first.wanted == {"cruise[1].late_action": not late}


def test_who_has_no_parameter_for_it_is_not_asked(found):
    """Nor is anything said of algorithms that do more than step, or of instances with steps of their own."""
    assert found(load("comfort_cruise", algorithm="jacobi")) == []
    assert found(ato(algorithm="iterative")) == []
    system = ato()
    system.instances["ato"].step = 0.02
    assert found(system) == []
