from .checking import validate
from .findings import Finding, Report
from .probing import TIMEOUT

__all__ = [
    "TIMEOUT",
    "Finding",
    "Report",
    "validate",
]
