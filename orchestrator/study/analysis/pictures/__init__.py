"""The pictures of a study: of its table, its plan, and what was recorded of its runs."""

from .drawing import draw_study

__all__ = ["draw_study"]
