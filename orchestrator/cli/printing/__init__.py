"""What the commands print: on a terminal in colour, in a pipe or file without.

`linear` is for the command that needs it to import: it brings SciPy.
"""

from .comparison import show_comparison
from .console import Log, and_figures, counted, folded, open_console, say, show_notes, tell
from .interface import show_interface
from .outcome import show_run
from .progress import show_compilations, show_progress
from .scenario import show_system
from .validation import show_report
from .verdicts import show_published, summary

__all__ = [
    "Log",
    "and_figures",
    "counted",
    "folded",
    "open_console",
    "say",
    "show_comparison",
    "show_compilations",
    "show_interface",
    "show_notes",
    "show_progress",
    "show_published",
    "show_report",
    "show_run",
    "show_system",
    "summary",
    "tell",
]
