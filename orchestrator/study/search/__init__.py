"""Searches: for the run that breaks a requirement, and for the changes that make metrics least."""

from ....components.doors import hang_door

hang_door(__name__)
