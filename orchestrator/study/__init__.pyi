from .batch import Batch
from .rows import Outcomes, Row
from .structure import Runner

__all__ = [
    "Batch",
    "Outcomes",
    "Row",
    "Runner",
]
