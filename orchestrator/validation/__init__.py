"""Whether anybody's FMU keeps the standard: read, compared with our own rules where it is ours, and tried."""

from .report import TIMEOUT, show_report, validate

__all__ = [
    "TIMEOUT",
    "show_report",
    "validate",
]
