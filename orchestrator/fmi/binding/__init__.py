"""FMUs loaded into this process: their functions, called as their version of the standard has them.

Light to import: the process of an isolated FMU needs this and little else.
"""

from ....components.doors import hang_door

hang_door(__name__)
