"""One run: checked, simulated, recorded, judged, and written to a directory from which it can go on."""

from ...components.doors import hang_door

hang_door(__name__)
