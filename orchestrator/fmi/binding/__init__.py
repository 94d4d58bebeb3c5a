"""FMUs loaded into this process: their functions, called as their version of the standard has them.

Light to import: the process of an isolated FMU needs this and little else.
"""

from .channel import FmuChannel
from .fmi2 import FmuSlave
from .interfaces import plain_interface, read_interface
from .libraries import forget_paths, library, names_of_platform
from .loaded import LoadedSlave
from .versions import SLAVES, call_name

__all__ = [
    "SLAVES",
    "FmuChannel",
    "FmuSlave",
    "LoadedSlave",
    "call_name",
    "forget_paths",
    "library",
    "names_of_platform",
    "plain_interface",
    "read_interface",
]
