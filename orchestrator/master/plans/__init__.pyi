from .plan import CHANGES, PLACE, SIZES, SWING, Plan

__all__ = ["CHANGES", "PLACE", "SIZES", "SWING", "Plan"]
