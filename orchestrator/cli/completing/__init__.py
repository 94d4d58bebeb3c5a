"""What a shell offers while a command is typed: nothing is checked or imported that could execute what a file says."""

from ....components.doors import hang_door

hang_door(__name__)
