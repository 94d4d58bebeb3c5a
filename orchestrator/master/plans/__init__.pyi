from .layout import CHANGES, PLACE, SIZES, SWING, Kind
from .plan import Plan

__all__ = ["CHANGES", "PLACE", "SIZES", "SWING", "Kind", "Plan"]
