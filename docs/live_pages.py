"""The live pages of the site: a run of each paper's scenario, with its models in the page.

They are kept in ``build/live`` and made anew when code or scenario is newer, which takes seconds each.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from railcosim.orchestrator import load, run
from railcosim.orchestrator.report import write_report

ROOT = Path(__file__).parents[1]
SCENARIOS = ("comfort_cruise", "tunable_potential", "cailc", "fault_tolerant_cruise")
_MADE_OF = ("components", "fmus", "orchestrator", "models")
_CODE = {".py", ".c", ".h", ".js", ".css", ".toml", ".json"}


def live_pages(folder: Path = ROOT / "build" / "live") -> dict[str, Path]:
    """The file of each page by the scenario's name.

    Args:
        folder: where they are kept.
    """
    newest = max(path.stat().st_mtime for name in _MADE_OF for path in (ROOT / name).rglob("*") if path.suffix in _CODE)
    found = {name: folder / f"{name}.html" for name in SCENARIOS}
    for name, path in found.items():
        if not path.exists() or path.stat().st_mtime < newest:
            folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryDirectory() as results:
                run(load(name), kind="native", output=Path(results) / name, figures=False)
                write_report([Path(results) / name], path, live=True)
    return found
