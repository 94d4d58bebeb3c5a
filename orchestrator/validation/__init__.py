"""Whether anybody's FMU keeps the standard: read, compared with our own rules where it is ours, and tried."""

from .checking import validate
from .findings import Finding, Report
from .probing import TIMEOUT

__all__ = [
    "TIMEOUT",
    "Finding",
    "Report",
    "validate",
]
