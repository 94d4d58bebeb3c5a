"""An FMU in a process of its own: its crash, hang or leak is an error of that instance, not our end."""

from ...components.doors import hang_door

hang_door(__name__)
