"""Algebraic loops: where values depend on themselves at one instant, and what they must be there."""

from ....components.doors import hang_door

hang_door(__name__)
