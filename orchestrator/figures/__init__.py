"""Pictures of recorded signals, as a scenario's `[[figures]]` ask for them; and the style of every other picture."""

from .checking import check_figures
from .curves import Curve, bracketed, curves_of
from .drawing import draw, draw_curves, file_name
from .panels import PANEL_KEYS, panels_of, share_x, texts_of
from .style import COLOURS, DASHES, colour, colour_and_dashes, legend, page

__all__ = [
    "COLOURS",
    "DASHES",
    "PANEL_KEYS",
    "Curve",
    "bracketed",
    "check_figures",
    "colour",
    "colour_and_dashes",
    "curves_of",
    "draw",
    "draw_curves",
    "file_name",
    "legend",
    "page",
    "panels_of",
    "share_x",
    "texts_of",
]
