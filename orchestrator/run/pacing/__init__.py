"""Runs in step with the clock."""

from ....components.doors import hang_door

hang_door(__name__)
