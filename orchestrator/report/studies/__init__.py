"""The page of a study, or of a search: all of its runs in one picture, and each of them by itself.

`table` reads the runs, `told` says what is known of them besides, and `page` writes it down.
"""

from ....components.doors import hang_door

hang_door(__name__)
