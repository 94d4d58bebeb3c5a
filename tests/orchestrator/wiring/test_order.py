"""The order of a Gauss-Seidel sweep follows from direct feed-through, and what it cannot serve is said."""

import pytest
from railcosim.orchestrator.names import SignalName
from railcosim.orchestrator.system import Connection
from railcosim.orchestrator.wiring import Link
from railcosim.orchestrator.wiring.order import derive_order


def link(source, target, *, direct=False, delay=0):
    """A connection ``"a.y"`` -> ``"b.u"``; direct where y depends on an input of a at one instant."""
    a, b = SignalName.parse(source), SignalName.parse(target)
    return Link(a, b, 1.0, 0.0, delay, direct, Connection(source, target, delay))


def platoon(n, *, delay=0):
    """Trains, controllers and a target, declared in the awkward sequence plants first."""
    links = []
    for i in range(1, n + 1):
        links += [
            link(f"train{i}.position", f"cruise{i}.position"),
            link(f"cruise{i}.force", f"train{i}.force", direct=True, delay=delay),
            link("target.value", f"cruise{i}.target"),
        ]
        if i > 1:
            links.append(link(f"train{i - 1}.position", f"cruise{i}.ahead"))
    return ["target", *(f"train{i}" for i in range(1, n + 1)), *(f"cruise{i}" for i in range(1, n + 1))], links


def test_controllers_first_plants_next_sources_of_the_controllers_last():
    instances, links = platoon(3)
    order = derive_order(instances, links)
    assert order.sequence == ("cruise1", "cruise2", "cruise3", "target", "train1", "train2", "train3")
    assert order.late == ()


def test_a_source_steps_after_the_plant_it_disturbs():
    """So that the gust a train feels over a step is that of the step's begin, like the force."""
    order = derive_order(["gust", "train"], [link("gust.acceleration", "train.disturbance")])
    assert order.sequence == ("train", "gust")


def test_a_chain_of_feed_through_blocks_steps_in_its_own_direction():
    links = [
        link("plant.x", "sensor.u"),
        link("sensor.y", "controller.u", direct=True),
        link("controller.force", "actuator.u", direct=True),
        link("actuator.force", "plant.force", direct=True),
    ]
    order = derive_order(["plant", "actuator", "controller", "sensor"], links)
    assert order.sequence == ("sensor", "controller", "actuator", "plant")
    assert order.late == ()


def test_a_chain_of_blocks_without_feed_through_steps_against_its_direction():
    """Each then hands on its value of the step's begin: one time stamp for all."""
    links = [link("a.x", "b.u"), link("b.x", "c.u")]
    assert derive_order(["a", "b", "c"], links).sequence == ("c", "b", "a")


def test_the_sequence_of_declaration_breaks_ties():
    assert derive_order(["z", "a", "m"], []).sequence == ("z", "a", "m")


def test_a_delayed_connection_does_not_constrain():
    instances = ["train", "cruise"]
    force = link("cruise.force", "train.force", direct=True)
    assert derive_order(instances, [force]).sequence == ("cruise", "train")
    order = derive_order(instances, [link("cruise.force", "train.force", direct=True, delay=1)])
    assert order.sequence == ("train", "cruise")
    assert order.late == ()


def test_an_algebraic_loop_keeps_the_declared_sequence_and_says_what_is_late():
    links = [link("a.y", "b.u", direct=True), link("b.y", "a.u", direct=True)]
    order = derive_order(["b", "a"], links)
    assert order.sequence == ("b", "a")
    assert order.late == ("b.u receives a.y one communication step late: the order has a cycle there",)


def test_a_delay_breaks_a_loop():
    links = [link("a.y", "b.u", direct=True), link("b.y", "a.u", direct=True, delay=1)]
    order = derive_order(["b", "a"], links)
    assert (order.sequence, order.late) == (("a", "b"), ())


def test_in_a_mixed_cycle_feed_through_is_served_first():
    """A controller with both a force (feed-through) and a mode (from memory) for the plant cannot serve both."""
    links = [link("cruise.mode", "train.mode"), link("cruise.force", "train.force", direct=True)]
    order = derive_order(["train", "cruise"], links)
    assert order.sequence == ("cruise", "train")
    assert order.late == (
        "train.mode receives cruise.mode of the end of the step instead of its begin: the order has a cycle there",
    )


def test_what_stands_outside_a_cycle_is_ordered_all_the_same():
    links = [
        link("a.y", "b.u", direct=True),
        link("b.y", "a.u", direct=True),
        link("first.y", "a.v", direct=True),
        link("b.y", "last.u", direct=True),
    ]
    order = derive_order(["last", "b", "a", "first"], links)
    assert order.sequence == ("first", "b", "a", "last")
    assert len(order.late) == 1


def test_an_output_fed_back_to_its_own_instance():
    """From a state it has the time stamp of the step's begin; a feed-through one is a step late, and that is said."""
    assert derive_order(["a"], [link("a.x", "a.u")]).late == ()
    assert derive_order(["a"], [link("a.y", "a.u", direct=True)]).late == (
        "a.u receives a.y one communication step late: the order has a cycle there",
    )


@pytest.mark.parametrize(
    ("chosen", "late"),
    [
        (("cruise1", "train1", "target"), ()),
        (("train1", "cruise1", "target"), ("train1.force receives cruise1.force one communication step late",
                                           "cruise1.position receives train1.position of the end of the step")),
        (("target", "cruise1", "train1"), ("cruise1.target receives target.value of the end of the step",)),
    ],
)  # fmt: skip
def test_a_chosen_order_is_kept_and_checked(chosen, late):
    instances, links = platoon(1)
    order = derive_order(instances, links, chosen)
    assert order.sequence == chosen
    assert len(order.late) == len(late)
    assert all(any(text.startswith(start) for text in order.late) for start in late)


def test_each_pair_of_instances_is_told_once():
    links = [link("a.x[1]", "b.u[1]"), link("a.x[2]", "b.u[2]")]
    assert len(derive_order(["a", "b"], links, ["a", "b"]).late) == 1
