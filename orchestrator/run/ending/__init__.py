"""How a run ends before its time: signals that ask for it, and processes that are gone."""

from ....components.doors import hang_door

hang_door(__name__)
