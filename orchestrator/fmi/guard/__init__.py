"""Guarded calls of FMUs: which one is under way is noted, and none ends the process unnoticed or with code 0."""

from ....components.doors import hang_door

hang_door(__name__)
