"""Whether anybody's FMU keeps the standard: read, compared with our own rules where it is ours, and tried."""

from .report import TIMEOUT, Finding, Report, validate

__all__ = [
    "TIMEOUT",
    "Finding",
    "Report",
    "validate",
]
