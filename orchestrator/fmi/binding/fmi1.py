"""An FMI 1.0 co-simulation FMU behind the face of an instance."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from ctypes import c_bool, c_char_p, c_double, c_int, c_size_t, c_void_p
from pathlib import Path
from typing import Any

from fmpy import fmi1
from fmpy.logging import addLoggerProxy
from lxml import etree

from ..interface import Type
from ..slave import Channel
from .instance import DISCARD, LOGGER, OK, WARNING
from .libraries import Signatures
from .loaded import LoadedSlave

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
    "Boolean": ("Boolean", c_bool),  # a char; what is not zero is true
    "String": ("String", c_char_p),
}


class Fmi1Slave(LoadedSlave):
    """An FMI 1.0 FMU loaded into this process. Its states cannot be saved: the standard has no call for that."""

    SIGNATURES, TYPES = _SIGNATURES, _TYPES
    SET, GET, DO_STEP = "fmiSet", "fmiGet", "fmiDoStep"
    TERMINATE, FREE, CANCEL = "fmiTerminateSlave", "fmiFreeSlaveInstance", "fmiCancelStep"
    INTERPOLATE = "fmiSetRealInputDerivatives"

    def _prefix(self) -> str:
        return f"{self.interface.identifier}_"

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
        self.call("fmiInitializeSlave", self._span[0], *self._end())

    def exit_initialization(self) -> None:
        """Nothing is left to be done."""

    def channel(self, kind: Type, names: Sequence[str]) -> Channel:
        """Prepare variables of one type for being set or read together."""
        plain = super().channel(kind, names)
        negated = [self.interface.variables[name].negated for name in names]
        return _NegatedChannel(plain, negated, kind) if any(negated) else plain

    def step(self, time: float, length: float, *, final: bool = True) -> None:
        """Advance from ``time`` by ``length``, both in s."""
        super().step(time, length, final=True)  # in FMI 1.0 that argument says that the last step was accepted

    def _attempt(self, time: float, part: float, final: bool, *, again: bool) -> int:
        return int(self._do_step(self.pointer, time, part, not again))

    def _last_successful_time(self) -> float | None:
        ask, found = self.functions.get("fmiGetRealStatus"), c_double(math.nan)
        status = DISCARD if ask is None else ask(self.pointer, _LAST_SUCCESSFUL_TIME, ctypes.byref(found))
        return found.value if status in (OK, WARNING) and math.isfinite(found.value) else None

    def directional_derivatives(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
    ) -> list[float]:
        """The standard has no call for that."""
        raise self.refuse("FMI 1.0 knows no directional derivatives")

    def interpolate(self, names: Sequence[str], orders: Sequence[int], values: Sequence[float]) -> None:
        """Time derivatives of inputs over the coming step: one name, order (from 1) and value each."""
        variables = self.interface.variables
        signed = [-x if variables[name].negated else x for name, x in zip(names, values, strict=True)]
        super().interpolate(names, orders, signed)


class _NegatedChannel:
    """Variables some of which are another's negative: what the library keeps is minus (or not) their value."""

    def __init__(self, plain: Channel, negated: Sequence[bool], kind: Type) -> None:
        self._plain, self._negated = plain, negated
        self._is_truth = kind == "Boolean"

    def _turned(self, values: Sequence[Any]) -> list[Any]:
        pairs = zip(values, self._negated, strict=True)
        return [((1 - value) if self._is_truth else -value) if negated else value for value, negated in pairs]

    def set(self, values: Sequence[Any]) -> None:
        """Set all of them."""
        self._plain.set(self._turned(values))

    def get(self) -> list[Any]:
        """Read all of them."""
        return self._turned(self._plain.get())
