"""Result files of any tool, by their ending: read into columns."""

from .....components.doors import hang_door

hang_door(__name__)
