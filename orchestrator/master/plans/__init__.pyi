from .ability import is_able
from .layout import APART, CHANGES, CONTROL, PLACE, SIZES, SWING, Kind
from .plan import Plan

__all__ = ["APART", "CHANGES", "CONTROL", "PLACE", "SIZES", "SWING", "Kind", "Plan", "is_able"]
