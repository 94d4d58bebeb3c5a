from .arrays import Calls, ElementsChannel, Held, are_as_called, arrays_in, by_type, calls_of, heads, whole_arrays
from .channel import FmuChannel, MixedChannel, heed_parts
from .fmi1 import Fmi1Slave
from .fmi2 import FmuSlave
from .fmi3 import Fmi3Slave
from .interfaces import plain_interface, read_interface
from .libraries import forget_paths, library, names_of_platform
from .loaded import LoadedSlave
from .stepping import DISCARD, FATAL
from .versions import SLAVES, call_name
from .watch import Watch, is_watched

__all__ = [
    "DISCARD",
    "FATAL",
    "SLAVES",
    "Calls",
    "ElementsChannel",
    "Fmi1Slave",
    "Fmi3Slave",
    "FmuChannel",
    "FmuSlave",
    "Held",
    "LoadedSlave",
    "MixedChannel",
    "Watch",
    "are_as_called",
    "arrays_in",
    "by_type",
    "call_name",
    "calls_of",
    "forget_paths",
    "heads",
    "heed_parts",
    "is_watched",
    "library",
    "names_of_platform",
    "plain_interface",
    "read_interface",
    "whole_arrays",
]
