from .blame import Culprit
from .judging import Decision, Word
from .points import Points
from .scales import scales_of
from .values import Formula, Rehearsed, Scales, decoded, horizon, is_temporal

__all__ = [
    "Culprit",
    "Decision",
    "Formula",
    "Points",
    "Rehearsed",
    "Scales",
    "Word",
    "decoded",
    "horizon",
    "is_temporal",
    "scales_of",
]
