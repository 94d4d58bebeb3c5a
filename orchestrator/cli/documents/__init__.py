"""What the commands answer as data, for `--json`: a declared document for each command, and the one way to print it."""

from ....components.doors import hang_door

hang_door(__name__)
