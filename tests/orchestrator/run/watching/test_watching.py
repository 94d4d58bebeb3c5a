"""What no train can do, and what controllers say of themselves, is found in every run, at every point."""

import dataclasses
import json
import math
from pathlib import Path

import pytest
from railcosim.orchestrator import System, load, run
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.run.execution import resume
from railcosim.orchestrator.run.watching import watching
from railcosim.orchestrator.system import Connection, Event

TOYS = Path(__file__).parents[3] / "toys.py"


def toy(name):
    return f"{TOYS}:{name}"


def pushed(model="Cart", push=-1.0, stop=10.0, start=4.0, **how):
    """A train that is pushed from the time 1 s on: of another maker's, so that it goes wherever it is pushed."""
    system = System(stop_time=stop, step=0.5, **how)
    system.add("train", toy(model), speed=start)
    system.add("push", "Schedule", build={"points": 2, "unit": "N"}, times=[0.0, 1.0], values=[0.0, push])
    system.connect("push.value", "train.force")
    return system


def found(system, kind="plain", **how):
    return run(system, kind=kind, **how).findings


# -------------------------------------------------------------------- reversing, and running away


def test_reversing():
    (told,) = found(pushed())
    assert (told.kind, told.instances, told.signal) == ("reversing", ("train",), "train.speed")
    assert (told.since, told.worst_time) == (5.5, 10.0)
    assert told.worst == pytest.approx(-5.0)
    assert str(told) == "reversing: train runs backwards from t = 5.5 s on, with -5 m/s at t = 10 s"
    assert told.spoils


@pytest.mark.parametrize("speed", [0.0, -1e-9, -0.009])
def test_rest_is_no_reversing(speed):
    assert found(pushed(push=0.0, start=speed)) == []


def test_who_starts_backwards_reverses():
    (told,) = found(pushed(push=0.0, start=-0.5))
    assert (told.kind, told.since, told.worst) == ("reversing", 0.0, pytest.approx(-0.5))


def test_growth_beyond_every_train():
    (told,) = found(pushed(push=1e4))
    assert (told.kind, told.since) == ("runaway", 1.5)
    assert told.worst == pytest.approx(9e4 + 4.0)
    assert "faster than any train, 340 m/s" in str(told)


def test_the_speed_of_a_train_in_km_per_h(foreign, xml):
    """Its unit says what 0.01 m/s and 340 m/s are."""
    v = xml["variable"]
    unit = '<Unit name="km/h"><BaseUnit m="1" s="-1" factor="0.2777777777777778"/></Unit>'
    system = System(stop_time=1.0, step=0.5)
    body = "    def step(self, t, h, v):\n        v[1] = 1300.0 if t > 0.4 else 1200.0"
    variables = [v("position", "output"), v("speed", "output", unit="km/h"), v("force", "input", start=0.0)]
    system.add("train", foreign(variables, body, units=unit))
    (told,) = found(system, "python")
    assert (told.kind, told.since) == ("runaway", 1.0)
    assert told.worst == pytest.approx(1300.0 / 3.6)


@pytest.mark.parametrize("kind", ["plain", "python"])
@pytest.mark.parametrize("record", [None, 10.0])
def test_every_point_is_seen_whatever_is_recorded(kind, record):
    """The train is pushed back at once and forth again: backwards in two points that no row shows."""
    system = pushed(start=1.0, record=record)
    system.instances["push"].build["points"] = 3
    system.instances["push"].start.update(times=[0.0, 1.0, 2.5], values=[0.0, -1.0, 1.0])
    outcome = run(system, kind=kind)
    (told,) = outcome.findings
    assert (told.since, told.worst, told.worst_time) == (2.5, pytest.approx(-0.5), 2.5)
    assert len(outcome.time) == (21 if record is None else 2)


def test_steps_of_varying_length():
    system = pushed("Cart", record=5.0, algorithm="adaptive")
    (told,) = found(system)
    assert told.kind == "reversing"
    assert told.since < 8.0


# -------------------------------------------------------------------- collisions


def platoon(gap=11.0, closing=4.0, **how):
    """Two trains that no force acts on; the one behind hears the one ahead, and closes up."""
    system = System(stop_time=10.0, step=0.5, **how)
    for i in (1, 2):
        system.add(f"train[{i}]", toy("Cart"), position=-gap * (i - 1), speed=10.0 + closing * (i - 1))
        system.add(f"cruise[{i}]", "ComfortCruise", has_ahead=i > 1, target_speed=10.0)
        system.connect(f"train[{i}].position", f"cruise[{i}].position")
        system.connect(f"train[{i}].speed", f"cruise[{i}].speed")
    system.connect("train[1].position", "cruise[2].ahead_position")
    system.connect("train[1].speed", "cruise[2].ahead_speed")
    return system


def collisions(findings):
    return [told for told in findings if told.kind == "collision"]


@pytest.mark.parametrize("record", [None, 10.0])
def test_collision(record):
    (told,) = collisions(found(platoon(record=record)))
    assert told.instances == ("train[2]", "train[1]")
    assert (told.since, told.worst, told.worst_time) == (3.0, pytest.approx(-29.0), 10.0)
    what = "train[2] reaches train[1], which runs ahead of it, at t = 3 s, and is up to 29 m past it (t = 10 s)"
    assert str(told) == f"collision: {what}"


def test_to_touch_is_a_collision_and_to_come_near_is_none():
    (told,) = collisions(found(platoon(40.0)))
    assert (told.since, told.worst) == (10.0, pytest.approx(0.0, abs=1e-9))
    assert "past it" not in str(told)
    assert collisions(found(platoon(40.1))) == []


def test_an_order_that_the_wiring_contradicts_from_the_start():
    (told,) = collisions(found(platoon(-5.0)))
    assert (told.since, told.worst) == (0.0, pytest.approx(-45.0))


def test_the_gravest_comes_first():
    kinds = [told.kind for told in found(platoon())]
    assert kinds == ["collision", "left its domain"]


# -------------------------------------------------------------------- what controllers say


def test_a_controller_that_leaves_its_domain():
    told = next(told for told in found(platoon(16e3, 300.0)) if told.kind == "left its domain")
    assert told.signal == "cruise[2].range_violated"
    assert told.since == 4.0  # a feed-through output is of the step's begin
    end = "(cruise[2].range_violated), first at t = 4 s, last at t = 10 s"
    assert str(told) == f"left its domain: cruise[2] has a gap outside the range it is made for {end}"


def test_a_controller_that_refuses():
    """The sampled loop of the learning control is unstable at 0.2 s."""
    system = load("cailc", step=0.2, stop_time=2.0, settings=["simulation.record=0.2"])
    told = found(system)[0]
    assert (told.kind, told.instances, told.since) == ("refused", ("ato",), 0.0)
    assert str(told).startswith("refused: ato refuses to drive (ato.refused), first at t = 0 s")


def test_a_fallback_is_told_and_spoils_nothing():
    system = load("degraded_radio", stop_time=700.0)
    findings = found(system, "auto")
    assert {told.kind for told in findings} == {"degraded"}
    assert not any(told.spoils for told in findings)


def test_a_flag_that_is_good_when_it_is_up(foreign, xml):
    v = xml["variable"]
    names = ["conditions_met", "barrier_violated"]
    system = System(stop_time=1.0, step=0.5)
    system.add(
        "law",
        foreign([v(name, "output", "Boolean") for name in names], "    def step(self, t, h, v):\n        v[1] = True"),
    )
    assert [(told.signal, told.since) for told in found(system, "python")] == [
        ("law.conditions_met", 0.0),
        ("law.barrier_violated", 0.5),
    ]


def test_only_flags_are_asked(foreign, xml):
    """A number of that name says something else."""
    v = xml["variable"]
    system = System(stop_time=1.0, step=0.5)
    system.add("law", foreign([v("refused", "output"), v("degraded", "local", "Boolean", start=True)]))
    assert found(system, "python") == []


# -------------------------------------------------------------------- divergence


def spring(stiffness=25.0, **how):
    """A mass on a spring, each told of the other one step late."""
    system = System(stop_time=4.0, step=0.1, algorithm="jacobi", **how)
    system.add("mass", toy("Mass"))
    system.add("spring", toy("Spring"), stiffness=stiffness)
    system.connect("mass.x", "spring.x")
    system.connect("spring.a", "mass.a")
    return system


@pytest.mark.parametrize("record", [None, 2.0])
def test_a_coupling_that_diverges_slowly(record):
    (told,) = found(spring(record=record))
    assert told.kind == "diverging"
    assert told.spoils
    assert "mass.x, spring.a diverges: its swings become larger" in str(told)


def test_a_coupling_that_does_not():
    assert found(spring().changed(step=0.001)) == []


# -------------------------------------------------------------------- the record, and runs that go on


def test_the_record(tmp_path):
    outcome = run(pushed(), kind="plain", output=tmp_path)
    written = json.loads((tmp_path / "run.json").read_text(encoding="utf-8"))["findings"]
    assert written == [dataclasses.asdict(told) | {"instances": ["train"]} for told in outcome.findings]


def test_a_run_that_goes_on_knows_what_was_before(tmp_path):
    """It ran backwards before the checkpoint, in points that are not recorded, and not since."""
    system = pushed(stop=20.0, start=1.0, record=10.0)
    system.instances["push"].build["points"] = 3
    system.instances["push"].start.update(times=[0.0, 1.0, 2.5], values=[0.0, -1.0, 1.0])
    whole = run(system, kind="python")
    run(system, kind="python", output=tmp_path, stop_time=10.0, checkpoint_every=5.0)
    outcome = resume(tmp_path, stop_time=20.0)
    assert outcome.findings == whole.findings != []


@pytest.mark.parametrize("saved", [None, [["x"]], [[0, 1.0]], [[99, 0.0, 0.0, 0.0, 0.0]], 3])
def test_a_checkpoint_of_something_else_is_refused(saved):
    with pytest.raises(ScenarioError, match="what the checkpoint says of findings does not fit"):
        watching.Watching(System(), {}, watching.Wiring(), []).restore(saved)


def test_a_run_that_fails_tells_what_it_found():
    system = pushed(start=-1.0)
    system.add("other", toy("Fails"), until=2.0)
    with pytest.raises(RuntimeError) as caught:
        run(system, kind="plain")
    assert [told.kind for told in caught.value.run.findings] == ["reversing"]
    assert math.isclose(caught.value.run.findings[0].since, 0.0)


def leaving(**how):
    """The second runs through the first, which it hears ahead, at 6 s; from 4 s on it hears the third, far ahead."""
    system = System(stop_time=10.0, step=0.5)
    for name, position, speed in (("first", 30.0, 0.0), ("second", 0.0, 5.0), ("third", 900.0, 0.0)):
        system.add(name, toy("Cart"), position=position, speed=speed)
    system.add("cruise", "ComfortCruise", has_ahead=True, has_behind=False, target_speed=5.0)
    for name in ("position", "speed"):
        system.connect(f"second.{name}", f"cruise.{name}")
        system.connect(f"first.{name}", f"cruise.ahead_{name}")
        source = Connection(f"third.{name}", f"cruise.ahead_{name}")
        at = 4.0 if name == "position" else 3.0
        system.events.append(Event(f"cruise.ahead_{name}", "connect", at, source=source, **how))
    system.connect("cruise.force", "second.force", scale=0.0)
    return system


def reached(system):
    return [told for told in found(system) if told.kind == "collision"]


def test_who_has_left_is_not_collided_with():
    """Nothing pushes: the second does its 5 m/s."""
    before = leaving()
    before.events.clear()
    (told,) = reached(before)
    assert (told.kind, told.instances, told.since) == ("collision", ("second", "first"), pytest.approx(6.0, abs=0.5))
    assert reached(leaving()) == []
    assert reached(leaving(duration=1.0)) == [], "what comes back is not watched: nobody knows when"


def test_who_is_met_on_the_way_is_watched_from_then_on():
    system = leaving()
    system.instances["first"].start["position"] = 300.0
    system.instances["third"].start["position"] = 40.0
    (told,) = reached(system)
    assert (told.instances, told.since) == (("second", "third"), pytest.approx(8.0, abs=0.5))
