from .deviations import RecordedComparison
from .figures import draw_compared
from .preference import read_directions
from .recorded import compare_recorded, is_recorded
from .reproduce import published_cases
from .variants import Comparison, Row, compare, variants

__all__ = [
    "Comparison",
    "RecordedComparison",
    "Row",
    "compare",
    "compare_recorded",
    "draw_compared",
    "is_recorded",
    "published_cases",
    "read_directions",
    "variants",
]
