"""What a command loads: whatever it does not need would cost everybody who calls it."""

import subprocess
import sys

import pytest

CODE = """
import contextlib, io, sys
from railcosim.orchestrator.cli.app import call
with contextlib.redirect_stdout(io.StringIO()):
    code = call(sys.argv[1:])
heavy = HEAVY
assert code in (0, 1)
print(*[name for name in heavy if name in sys.modules])
"""
RUN = ["run", "comfort_cruise", "--stop", "1", "--kind", "plain", "--quiet", "--no-figures"]
EXTRAS = {"SALib", "bokeh", "cma", "dask", "distributed", "optuna", "pandas", "pyarrow"}
NEVER = {"casadi", "matplotlib", "networkx", "psutil", "pythonfmu", "rich.progress", "scipy", *EXTRAS}
"""What neither help, a list nor a run with FMUs at hand needs; matplotlib draws, psutil is asked by large runs."""
ROOMS = {f"railcosim.orchestrator.{room}" for room in ("comparison", "linearization", "packing", "report", "study")}


@pytest.mark.parametrize(
    ("arguments", "absent"),
    [
        (["--help"], {"numpy", "fmpy", "lxml", "rich", "pydantic", "railcosim.orchestrator.run", *NEVER, *ROOMS}),
        (["run", "--help"], {"numpy", "fmpy", "lxml", "rich", "railcosim.orchestrator.run", *NEVER, *ROOMS}),
        (["list"], {"fmpy", "filelock", "railcosim.orchestrator.run", *NEVER, *ROOMS}),
        (RUN, {*NEVER, *ROOMS}),
    ],
    ids=lambda value: " ".join(value[:2]) if isinstance(value, list) else "",
)
def test_a_command_loads_what_it_needs_and_no_more(arguments, absent, tmp_path):
    code = CODE.replace("HEAVY", repr(sorted(absent)))
    command = [sys.executable, "-c", code, *arguments, *(["-o", str(tmp_path / "out")] if arguments is RUN else [])]
    found = subprocess.run(command, capture_output=True, text=True, check=True)
    assert found.stdout.split() == []
