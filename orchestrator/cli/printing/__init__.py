"""What the commands print: on a terminal in colour, in a pipe or file without.

`linear` is for the command that needs it to import: it brings SciPy.
"""

from ....components.doors import hang_door

hang_door(__name__)
