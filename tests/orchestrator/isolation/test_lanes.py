"""The lane as Python has it: what it refuses, and how long it is watched."""

import struct

import pytest
from railcosim.orchestrator.isolation import HAS_LANES, lanes, messages
from railcosim.orchestrator.isolation.lanes import lane

pytestmark = pytest.mark.skipif(not HAS_LANES, reason="there are no lanes here")


ASKING = messages.SET_SLOPES, messages.ASK, messages.ASK_3
PLACE = 1, 1, 1  # function, instance, and what is beside them
UNSOUND = [
    (messages.LANE_SET, 0, 1, 1, 1, 1, 64),
    *((kind, *PLACE, 1, 1, 64) for kind in (-1, messages.LANE_RESTORE_NOW)),
    *((messages.LANE_GET_3, *PLACE, *place) for place in ((2, 1, 64), (1, 1 << 20, 64), (0, 0, 1 << 20))),
    *((kind, *PLACE, room, 0, 64) for kind in ASKING for room in (600, 1 << 62)),
    *((kind, 1, 1, 0, 0, 0, 64) for kind in (messages.LANE_STEP_3, messages.LANE_SAVE)),
]
"""Operations: kind, function, instance, references; how many of these, of values, and where those stand."""


def test_what_does_not_fit_the_memory_is_refused():
    memory = bytearray(lane.SIZE + 128)
    with pytest.raises(ValueError, match="it does not fit into the memory"):
        lane.Lane(memory, 192, 0, 1.0, 0.0, print)
    road = lane.Lane(memory, 128, 0, 1.0, 0.0, print)

    with pytest.raises(ValueError, match="does not stand in the memory"):
        lane.Rider(road, -8, 0)
    rider = lane.Rider(road, 0, 0)
    for wrong in ((0, 64, 1 << 60, 8), (0, 64, 1, 9), (0, 64, 1, -1), *((kind, 64, 600, 0) for kind in ASKING)):
        with pytest.raises(ValueError, match="does not stand in the memory"):
            rider.add(*wrong)
    with pytest.raises(ValueError, match="it does not fit into the memory"):
        lane.serve(memory, 64 * 99, [], 0.0)
    for operations in (b"1", *(struct.pack("=q6Qq", *each, 0) for each in UNSOUND)):
        with pytest.raises(ValueError, match="do not fit its memory"):
            lane.serve(memory, 128, [(0, operations)], 0.0)
    assert road.done() == 0
    road.close()
    assert road.done() == 0
    assert road.wait(0.0) == lane.CLOSED
    assert not road.leave()


def test_it_is_watched_for_only_where_a_core_is_left(monkeypatch):
    for cores, is_watched in (({0}, False), ({0, 3}, True)):
        monkeypatch.setattr(lanes.os, "sched_getaffinity", lambda _, cores=cores: cores)
        assert (lanes.spin_time() > 0.0) == is_watched
