"""A whole scenario as one FMU."""

from ...components.doors import hang_door

hang_door(__name__)
