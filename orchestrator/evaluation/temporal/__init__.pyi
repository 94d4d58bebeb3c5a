from .blame import Culprit
from .judging import Decision, Word
from .points import Points
from .scales import scales_of
from .values import Formula, Scales, horizon, rehearsed_interval

__all__ = [
    "Culprit",
    "Decision",
    "Formula",
    "Points",
    "Scales",
    "Word",
    "horizon",
    "rehearsed_interval",
    "scales_of",
]
