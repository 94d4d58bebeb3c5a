"""What a study says: summary, sensitivity and figures, of its table and its plan."""

from .influence import Influence, Sensitivity, outputs_of, sensitivity
from .intervals import Estimate
from .pictures import draw_study
from .shown import summary_html
from .summary import SHARES, Kept, Spread, Summary, summarize

__all__ = [
    "SHARES",
    "Estimate",
    "Influence",
    "Kept",
    "Sensitivity",
    "Spread",
    "Summary",
    "draw_study",
    "outputs_of",
    "sensitivity",
    "summarize",
    "summary_html",
]
