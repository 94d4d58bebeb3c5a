from .figures import draw_compared
from .preference import read_directions
from .reproduce import published_cases
from .variants import Comparison, Row, compare, variants

__all__ = [
    "Comparison",
    "Row",
    "compare",
    "draw_compared",
    "published_cases",
    "read_directions",
    "variants",
]
