"""The class of an FMU's instances by version of FMI: all of `loading` that the process of an isolated one needs."""

from __future__ import annotations

from collections.abc import Sequence

from ..interface import Interface, Type
from .fmi1 import Fmi1Slave
from .fmi2 import FmuSlave
from .fmi3 import Fmi3Slave
from .loaded import LoadedSlave

SLAVES: dict[str, type[LoadedSlave]] = {"1.0": Fmi1Slave, "2.0": FmuSlave, "3.0": Fmi3Slave}

_NAMES = {
    "1.0": {"instantiate": "fmiInstantiateSlave", "enter_initialization": "fmiInitializeSlave"},
    "2.0": {
        "instantiate": "fmi2Instantiate",
        "setup": "fmi2SetupExperiment",
        "enter_initialization": "fmi2EnterInitializationMode",
        "exit_initialization": "fmi2ExitInitializationMode",
    },
    "3.0": {
        "instantiate": "fmi3InstantiateCoSimulation",
        "enter_initialization": "fmi3EnterInitializationMode",
        "exit_initialization": "fmi3ExitInitializationMode",
    },
}
"""Functions of the standard by what they are for, where the classes do not name them."""


def call_name(interface: Interface, call: str, kind: Type, names: Sequence[str]) -> str:
    """The function of the standard behind a method of an instance; of set and get, for these variables of this type."""
    slave = SLAVES[interface.version]
    if call in ("set", "get"):
        own = interface.variables[names[0]].fmi_type if names else ""
        return f"{slave.SET if call == 'set' else slave.GET}{slave.TYPES[own or kind][0]}"
    known = {"step": slave.DO_STEP, "terminate": slave.TERMINATE, "reset": slave.RESET, "free": slave.FREE}
    known |= {"interpolate": slave.INTERPOLATE, "directional_derivatives": slave.DERIVE} | _NAMES[interface.version]
    states = getattr(slave, "STATE", ())  # FMI 1.0 has none
    known |= dict(zip(("save", "restore", "forget", "size", "serialize", "deserialize"), states, strict=False))
    return known.get(call) or call
