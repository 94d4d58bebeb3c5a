from .comparison import show_comparison
from .console import open_console, say, show_notes, show_page
from .findings import show_findings
from .interface import show_interface, show_report
from .outcome import show_run
from .progress import show_cases, show_compilations, show_progress
from .scenario import show_system
from .searches import show_falsified, show_optimized, show_search
from .study import show_runs, show_study
from .verdicts import in_one_line, show_values, summary

__all__ = [
    "in_one_line",
    "open_console",
    "say",
    "show_cases",
    "show_comparison",
    "show_compilations",
    "show_falsified",
    "show_findings",
    "show_interface",
    "show_notes",
    "show_optimized",
    "show_page",
    "show_progress",
    "show_report",
    "show_run",
    "show_runs",
    "show_search",
    "show_study",
    "show_system",
    "show_values",
    "summary",
]
