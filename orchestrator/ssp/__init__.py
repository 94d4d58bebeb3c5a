"""SSP to `System`: archives of coupled systems as other tools write them.

`package` opens an archive, `documents` reads its XML, `structure` makes a tree of elements of it, `values` reads
parameter sets and mappings, `network` follows connections through nested systems, `transport` says what becomes of a
value on such a way, `settings` applies parameters by their precedence, `annotations` takes what other tools write
beside the standard, and `reading` makes a `System` of all that.
"""

from ...components.doors import hang_door

hang_door(__name__)
