from .blame import Culprit
from .judging import Decision, Word
from .points import Points
from .scales import common, scales_of
from .values import Formula, horizon, rehearsed_interval

__all__ = [
    "Culprit",
    "Decision",
    "Formula",
    "Points",
    "Word",
    "common",
    "horizon",
    "rehearsed_interval",
    "scales_of",
]
