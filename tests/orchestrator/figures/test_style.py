"""The look of a page: colours, legends, and matplotlib only where it is needed."""

import subprocess
import sys
from pathlib import Path


def test_many_curves_are_coloured_by_order(drawn):
    (ax,) = drawn(y=["car[:].speed"])
    assert len({str(line.get_color()) for line in ax.lines}) == 12


def test_the_legend_stands_beside_the_data(drawn):
    (ax,) = drawn(y=["train[:].speed"])
    assert ax.get_legend().get_window_extent().x0 >= ax.get_window_extent().x1


def test_matplotlib_is_imported_only_to_draw():
    code = "import sys, railcosim.orchestrator.figures; print('matplotlib' in sys.modules)"
    said = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=Path(__file__).parent
    )
    assert said.stdout.strip() == "False"
