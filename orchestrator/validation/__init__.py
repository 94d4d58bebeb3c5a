"""Whether anybody's FMU keeps the standard: read, compared with our own rules where it is ours, and tried."""

from ...components.doors import hang_door

hang_door(__name__)
