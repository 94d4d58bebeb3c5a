"""What the commands print: on a terminal in colour, in a pipe or file without.

`linear` and `study` are for the commands that need them to import: they bring SciPy and what is known of studies.
"""

from ....components.doors import hang_door

hang_door(__name__)
