"""Who is told of the steps as they are taken."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Rows = Sequence[Sequence[Any]] | NDArray[np.float64]
"""Of each the time in s, and all values."""
Observer = Callable[[int, Rows], bool]
"""Called after one or more steps with how many were taken and the rows that were due; False stops."""
