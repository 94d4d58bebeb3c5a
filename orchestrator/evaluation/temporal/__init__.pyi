from .blame import Culprit
from .judging import Decision, Word
from .points import Points
from .scales import scales_of
from .values import Formula, Scales, decoded, horizon, rehearsed_interval

__all__ = [
    "Culprit",
    "Decision",
    "Formula",
    "Points",
    "Scales",
    "Word",
    "decoded",
    "horizon",
    "rehearsed_interval",
    "scales_of",
]
