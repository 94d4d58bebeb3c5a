"""The closed loop of a scenario as a linear model, and what that says: modes, responses, string stability."""

from ...components.doors import hang_door

hang_door(__name__)
