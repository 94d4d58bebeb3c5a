from .channel import IsolatedChannel, IsolatedPart
from .choice import (
    ALL,
    AUTO,
    check_isolation,
    check_once_per_process,
    house,
    instantiate,
    is_isolated,
    isolate,
    isolation_notes,
)
from .lanes import HAS_LANES
from .launch import CRASHES, end_process, end_with_parent, signal_name, starting
from .proxy import IsolatedSlave
from .riding import Ride, may_ride
from .strangers import become_known, note_validation, strangers

__all__ = [
    "ALL",
    "AUTO",
    "CRASHES",
    "HAS_LANES",
    "IsolatedChannel",
    "IsolatedPart",
    "IsolatedSlave",
    "Ride",
    "become_known",
    "check_isolation",
    "check_once_per_process",
    "end_process",
    "end_with_parent",
    "house",
    "instantiate",
    "is_isolated",
    "isolate",
    "isolation_notes",
    "may_ride",
    "note_validation",
    "signal_name",
    "starting",
    "strangers",
]
