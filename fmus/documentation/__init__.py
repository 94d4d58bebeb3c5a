"""What an FMU says for itself: the page inside it, with its equations, and signals to check an importer by."""

from .page import files, page, stepping
from .reference_signals import EXCITATION, STEPS, reference_signals

__all__ = ["EXCITATION", "STEPS", "files", "page", "reference_signals", "stepping"]
