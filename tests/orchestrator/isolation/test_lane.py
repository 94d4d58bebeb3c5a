"""Both sides of a lane under the compiler's warnings and sanitizers, without Python between them."""

import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

GCC = shutil.which("gcc")
NATIVE = Path(__file__).parents[3] / "orchestrator" / "isolation" / "native"
pytestmark = [
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="there are no lanes here"),
    pytest.mark.skipif(GCC is None, reason="compiled by gcc here"),
    pytest.mark.long,
]


def compiled(sources, *flags):
    include = sysconfig.get_paths()["include"]
    subprocess.run([GCC, f"-I{include}", f"-I{NATIVE}", *flags, *map(str, sources)], check=True)


def test_the_compiler_has_nothing_to_say(tmp_path):
    warnings = ["-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror", "-O2"]
    compiled(sorted(NATIVE.glob("*.c")), *warnings, "-shared", "-fPIC", "-o", str(tmp_path / "lane.so"))


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
