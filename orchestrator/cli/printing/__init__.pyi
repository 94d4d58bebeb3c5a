from .comparison import show_comparison, show_recorded
from .console import open_console, say, show_notes, show_page
from .findings import show_findings
from .interface import show_interface, show_model, show_report
from .listing import show_list
from .outcome import show_reproduced, show_run
from .progress import show_cases, show_compilations, show_meshes, show_progress
from .scenario import show_check, show_system
from .searches import show_drive, show_falsified, show_optimized, show_search
from .study import show_runs, show_study

__all__ = [
    "open_console",
    "say",
    "show_cases",
    "show_check",
    "show_comparison",
    "show_compilations",
    "show_drive",
    "show_falsified",
    "show_findings",
    "show_interface",
    "show_list",
    "show_meshes",
    "show_model",
    "show_notes",
    "show_optimized",
    "show_page",
    "show_progress",
    "show_recorded",
    "show_report",
    "show_reproduced",
    "show_run",
    "show_runs",
    "show_search",
    "show_study",
    "show_system",
]
