"""Logic over time: the robustness of formulas at the points of a run, and what decides it."""

from ....components.doors import hang_door

hang_door(__name__)
