"""One HTML page of runs that opens from disk and asks the network for nothing.

`content` gathers what is shown, `payload` packs the signals, `tables` and `wiring` write the parts that need no script,
and `page` puts it all into one file. What the page does is in ``resources/``.
"""

from ...components.doors import hang_door

hang_door(__name__)
