"""What is no lane is refused; both sides under the compiler's warnings and sanitizers, without Python between them."""

import shutil
import struct
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from railcosim.orchestrator.isolation import HAS_LANES, lanes, messages
from railcosim.orchestrator.isolation.lanes import lane

GCC = shutil.which("gcc")
NATIVE = Path(__file__).parents[3] / "orchestrator" / "isolation" / "native"
pytestmark = [
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="there are no lanes here"),
    pytest.mark.skipif(not HAS_LANES, reason="installed without a C compiler"),
    pytest.mark.skipif(GCC is None, reason="compiled by gcc here"),
]


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


def compiled(sources, *flags):
    include = sysconfig.get_paths()["include"]
    subprocess.run([GCC, f"-I{include}", f"-I{NATIVE}", *flags, *map(str, sources)], check=True)


@pytest.mark.long
def test_the_compiler_has_nothing_to_say(tmp_path):
    warnings = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-O2"]
    compiled(sorted(NATIVE.glob("*.c")), *warnings, "-shared", "-fPIC", "-o", str(tmp_path / "lane.so"))


@pytest.mark.long
@pytest.mark.parametrize("sanitizers", ["thread", "address,undefined"])
def test_two_threads_hand_over_whole_values_and_none_is_lost(tmp_path, sanitizers):
    """Also where nobody watches: then each hand-over wakes a thread, and what is not waited for is asked for again."""
    program = tmp_path / "lane_alone"
    kept = ["-no-pie", "-Wl,--unresolved-symbols=ignore-all"]  # Python is not linked
    sources = [Path(__file__).with_name("lane_alone.c"), NATIVE / "lane.c", NATIVE / "riding.c"]
    flags = ["-g", "-O1", f"-fsanitize={sanitizers}", "-fno-sanitize-recover", "-pthread", *kept]
    compiled([*sources, "-lm"], *flags, "-o", str(program))
    for spin in ("0", "50000"):
        done = subprocess.run([program, spin], check=False, capture_output=True, text=True, timeout=60)
        assert (done.returncode, done.stdout, done.stderr) == (0, "20000 20000 1001\n", "")
