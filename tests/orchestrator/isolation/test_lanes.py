"""The lane as Python has it: what it refuses, and how long it is watched."""

import pytest
from railcosim.orchestrator.isolation import HAS_LANES, lanes
from railcosim.orchestrator.isolation.lanes import lane

pytestmark = pytest.mark.skipif(not HAS_LANES, reason="there are no lanes here")


def test_what_does_not_fit_the_memory_is_refused():
    memory = bytearray(lane.SIZE + 128)
    with pytest.raises(ValueError, match="it does not fit into the memory"):
        lane.Lane(memory, 192, 0, 1.0, 0.0, print)
    road = lane.Lane(memory, 128, 0, 1.0, 0.0, print)

    def add(*place):
        return lane.Rider(road, 0, 0).add(0, *place)

    for wrong in (lambda: lane.Rider(road, -8, 0), lambda: add(64, 1 << 60, 8), lambda: add(64, 1, 9)):
        with pytest.raises(ValueError, match="does not stand in the memory"):
            wrong()
    with pytest.raises(ValueError, match="it does not fit into the memory"):
        lane.serve(memory, 64 * 99, [], 0.0)
    for operations in (b"1", bytes(64)):
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
