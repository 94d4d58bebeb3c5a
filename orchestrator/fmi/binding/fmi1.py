"""An FMI 1.0 co-simulation FMU behind the face of an instance."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from ctypes import c_bool, c_char_p, c_double, c_int, c_size_t, c_uint8, c_void_p
from pathlib import Path
from typing import Any

from fmpy import fmi1
from fmpy.logging import addLoggerProxy
from lxml import etree

from .libraries import Signatures
from .loaded import LoadedSlave
from .messages import LOGGER
from .stepping import DISCARD, OK, WARNING

_LAST_SUCCESSFUL_TIME = 2
"""What fmiGetRealStatus is asked for."""
_STAND_ALONE = "application/x-fmu-sharedlibrary"
_SIGNATURES: Signatures = {
    "fmiInstantiateSlave": (
        c_void_p, c_char_p, c_char_p, c_char_p, c_char_p, c_double, c_bool, c_bool,
        fmi1.fmi1CallbackFunctions, c_bool
    ),
    "fmiFreeSlaveInstance": (None, c_void_p),
    "fmiInitializeSlave": (c_int, c_void_p, c_double, c_bool, c_double),
    "fmiTerminateSlave": (c_int, c_void_p),
    "fmiResetSlave": (c_int, c_void_p),
    "fmiDoStep": (c_int, c_void_p, c_double, c_double, c_bool),
    "fmiCancelStep": (c_int, c_void_p),
    **{
        f"fmi{verb}{suffix}": (c_int, c_void_p, c_void_p, c_size_t, c_void_p)
        for verb in ("Set", "Get")
        for suffix in ("Real", "Integer", "Boolean", "String")
    },
    "fmiGetRealStatus": (c_int, c_void_p, c_int, c_void_p),
    "fmiSetRealInputDerivatives": (c_int, c_void_p, c_void_p, c_size_t, c_void_p, c_void_p),
}  # fmt: skip
_TYPES: dict[str, tuple[str, Any]] = {
    "Real": ("Real", c_double),
    "Integer": ("Integer", c_int),
    "Enumeration": ("Integer", c_int),
    "Boolean": ("Boolean", c_uint8),  # a byte, of which any bit is true
    "String": ("String", c_char_p),
}


class Fmi1Slave(LoadedSlave):
    """An FMI 1.0 FMU loaded into this process. Its states cannot be saved: the standard has no call for that."""

    SIGNATURES, TYPES = _SIGNATURES, _TYPES
    SET, GET, DO_STEP = "fmiSet", "fmiGet", "fmiDoStep"
    TERMINATE, RESET, FREE = "fmiTerminateSlave", "fmiResetSlave", "fmiFreeSlaveInstance"
    CANCEL = "fmiCancelStep"
    INTERPOLATE = "fmiSetRealInputDerivatives"
    PREFIXED = True

    def _instantiate(self, folder: Path) -> int | None:
        self._callbacks = fmi1.fmi1CallbackFunctions()
        self._callbacks.logger = LOGGER
        self._callbacks.allocateMemory = fmi1.defaultCallbacks.allocateMemory
        self._callbacks.freeMemory = fmi1.defaultCallbacks.freeMemory
        addLoggerProxy(ctypes.byref(self._callbacks))
        names = self.name, self.interface.guid, folder.as_uri(), self._mime_type(folder)
        found: int | None = self.function("fmiInstantiateSlave")(
            *(text.encode() for text in names), 0.0, False, False, self._callbacks, self._talks
        )
        if found:
            self.hear_as(found)
        return found

    def _mime_type(self, folder: Path) -> str:
        """What runs behind the library: nothing, or a tool that the description names."""
        if not self.interface.needs_tool:
            return _STAND_ALONE
        parser = etree.XMLParser(resolve_entities=False, no_network=True)
        root = etree.parse(str(folder / "modelDescription.xml"), parser).getroot()
        model = root.find("Implementation/CoSimulation_Tool/Model")
        return str(_STAND_ALONE if model is None else model.get("type", _STAND_ALONE))

    def enter_initialization(self) -> None:
        """Initialize it.

        FMI 1.0 has no initialization mode, in which inputs are set and outputs are read in turn; but it lets both be
        done after fmiInitializeSlave and before the first step. That call therefore stands where the mode begins:
        start values have been set, and what connected instances give each other can be exchanged until it settles.
        """
        self.call_once("fmiInitializeSlave", self._span[0], *self._end())

    def exit_initialization(self) -> None:
        """Nothing is left to be done."""

    def _configure(self) -> None:
        pass  # the standard has no structural parameters

    def _announce(self) -> None:
        pass  # the call that initializes it says it all

    def _attempt(self, time: float, part: float, final: bool, *, again: bool) -> int:
        # In FMI 1.0 the last argument says that the step before was accepted.
        return int(self._do_step(self.pointer, time, part, not again))

    def _is_cut_short(self) -> bool:
        return False

    def _stops(self, status: int) -> bool:
        return False

    def _last_successful_time(self) -> float | None:
        ask, found = self.functions.get("fmiGetRealStatus"), c_double(math.nan)
        status = DISCARD if ask is None else ask(self.pointer, _LAST_SUCCESSFUL_TIME, ctypes.byref(found))
        return found.value if status in (OK, WARNING) and math.isfinite(found.value) else None

    def directional_derivatives(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
    ) -> list[float]:
        """The standard has no call for that."""
        raise self.refuse("FMI 1.0 knows no directional derivatives")
