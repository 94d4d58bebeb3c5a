"""The equations: trains, controllers and their surroundings. Imports NumPy and nothing of this project.

`CATALOGUE` is the one table of shipped components; each name imports from here.
"""

from .doors import hang_door

hang_door(__name__)
