"""The rows of a run: taken while it goes, kept in memory or in files, read back."""

from ....components.doors import hang_door

hang_door(__name__)
