from .batch import Batch
from .campaign import Pool, Replayed, Study, packed, pool_for, replay, run_study
from .rows import Outcomes, Row
from .structure import Runner

__all__ = [
    "Batch",
    "Outcomes",
    "Pool",
    "Replayed",
    "Row",
    "Runner",
    "Study",
    "packed",
    "pool_for",
    "replay",
    "run_study",
]
