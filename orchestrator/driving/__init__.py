"""Optimal driving over a line: the train's own equations, traced, in a direct collocation over place."""

from ...components.doors import hang_door

hang_door(__name__)
