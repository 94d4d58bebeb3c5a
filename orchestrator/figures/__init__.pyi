from .checking import check_figures
from .curves import Curve, bracketed, curves_of, x_label_of
from .drawing import draw, draw_curves, file_name, plot, remove_drawn
from .marks import filled_title, number
from .palette import Palette, member_colour, ranks
from .panels import (
    FIGURE_KEYS,
    FORMATS,
    PANEL_KEYS,
    bands_of,
    heading,
    marks_of,
    panels_of,
    remarked,
    share_x,
    texts_of,
    written_as,
)
from .style import COLOURS, DASHES, colour, colour_and_dashes, legend, page

__all__ = [
    "COLOURS",
    "DASHES",
    "FIGURE_KEYS",
    "FORMATS",
    "PANEL_KEYS",
    "Curve",
    "Palette",
    "bands_of",
    "bracketed",
    "check_figures",
    "colour",
    "colour_and_dashes",
    "curves_of",
    "draw",
    "draw_curves",
    "file_name",
    "filled_title",
    "heading",
    "legend",
    "marks_of",
    "member_colour",
    "number",
    "page",
    "panels_of",
    "plot",
    "ranks",
    "remarked",
    "remove_drawn",
    "share_x",
    "texts_of",
    "written_as",
    "x_label_of",
]
