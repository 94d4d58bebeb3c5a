"""What is run: dimensions as people write them, designs, and the plan that is made of both."""

from .dimensions import Dimension
from .laws import LAWS, Law
from .options import make_plan, plan_notes
from .plan import Plan
from .sampling import DESIGNS

__all__ = [
    "DESIGNS",
    "LAWS",
    "Dimension",
    "Law",
    "Plan",
    "make_plan",
    "plan_notes",
]
