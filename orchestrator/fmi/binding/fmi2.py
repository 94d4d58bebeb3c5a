"""An FMI 2.0 co-simulation FMU behind the face of an instance."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from ctypes import c_char_p, c_double, c_int, c_size_t, c_void_p
from pathlib import Path
from typing import Any

from fmpy import fmi2
from fmpy.logging import addLoggerProxy

from .channel import FmuChannel
from .libraries import Signatures
from .loaded import LoadedSlave
from .messages import LOGGER
from .stepping import DISCARD, OK, WARNING

__all__ = ["FmuChannel", "FmuSlave"]

_LAST_SUCCESSFUL_TIME, _TERMINATED = 2, 3
"""What fmi2GetRealStatus and fmi2GetBooleanStatus are asked for."""
_SIGNATURES: Signatures = {
    "fmi2Instantiate": (c_void_p, c_char_p, c_int, c_char_p, c_char_p, c_void_p, c_int, c_int),
    "fmi2FreeInstance": (None, c_void_p),
    "fmi2SetupExperiment": (c_int, c_void_p, c_int, c_double, c_double, c_int, c_double),
    "fmi2EnterInitializationMode": (c_int, c_void_p),
    "fmi2ExitInitializationMode": (c_int, c_void_p),
    "fmi2Terminate": (c_int, c_void_p),
    "fmi2Reset": (c_int, c_void_p),
    "fmi2DoStep": (c_int, c_void_p, c_double, c_double, c_int),
    "fmi2CancelStep": (c_int, c_void_p),
    **{
        f"fmi2{verb}{suffix}": (c_int, c_void_p, c_void_p, c_size_t, c_void_p)
        for verb in ("Set", "Get")
        for suffix in ("Real", "Integer", "Boolean", "String")
    },
    **{f"fmi2Get{suffix}Status": (c_int, c_void_p, c_int, c_void_p) for suffix in ("Real", "Boolean")},
    "fmi2GetFMUstate": (c_int, c_void_p, c_void_p),
    "fmi2SetFMUstate": (c_int, c_void_p, c_void_p),
    "fmi2FreeFMUstate": (c_int, c_void_p, c_void_p),
    "fmi2SerializedFMUstateSize": (c_int, c_void_p, c_void_p, c_void_p),
    "fmi2SerializeFMUstate": (c_int, c_void_p, c_void_p, c_void_p, c_size_t),
    "fmi2DeSerializeFMUstate": (c_int, c_void_p, c_void_p, c_size_t, c_void_p),
    "fmi2GetDirectionalDerivative": (
        c_int, c_void_p, c_void_p, c_size_t, c_void_p, c_size_t, c_void_p, c_void_p
    ),
    "fmi2GetRealOutputDerivatives": (c_int, c_void_p, c_void_p, c_size_t, c_void_p, c_void_p),
    "fmi2SetRealInputDerivatives": (c_int, c_void_p, c_void_p, c_size_t, c_void_p, c_void_p),
}  # fmt: skip
_TYPES: dict[str, tuple[str, Any]] = {
    "Real": ("Real", c_double),
    "Integer": ("Integer", c_int),
    "Enumeration": ("Integer", c_int),
    "Boolean": ("Boolean", c_int),
    "String": ("String", c_char_p),
}


class FmuSlave(LoadedSlave):
    """An FMI 2.0 FMU loaded into this process."""

    SIGNATURES, TYPES = _SIGNATURES, _TYPES
    SET, GET, DO_STEP = "fmi2Set", "fmi2Get", "fmi2DoStep"
    TERMINATE, RESET, FREE, CANCEL = "fmi2Terminate", "fmi2Reset", "fmi2FreeInstance", "fmi2CancelStep"
    INTERPOLATE = "fmi2SetRealInputDerivatives"
    DERIVE = "fmi2GetDirectionalDerivative"
    STATE = (
        "fmi2GetFMUstate",
        "fmi2SetFMUstate",
        "fmi2FreeFMUstate",
        "fmi2SerializedFMUstateSize",
        "fmi2SerializeFMUstate",
        "fmi2DeSerializeFMUstate",
    )

    def _instantiate(self, folder: Path) -> int | None:
        self._callbacks = fmi2.fmi2CallbackFunctions()
        self._callbacks.logger = LOGGER
        self._callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
        self._callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
        self._callbacks.componentEnvironment = id(self)
        addLoggerProxy(ctypes.byref(self._callbacks))
        names = self.name, self.interface.guid, (folder / "resources").as_uri()
        name, guid, place = (text.encode() for text in names)
        found: int | None = self.function("fmi2Instantiate")(
            name, fmi2.fmi2CoSimulation, guid, place, ctypes.byref(self._callbacks), 0, self._talks
        )
        return found

    def enter_initialization(self) -> None:
        """Enter initialization mode."""
        self.call_once("fmi2EnterInitializationMode")

    def exit_initialization(self) -> None:
        """Leave initialization mode."""
        self.call_once("fmi2ExitInitializationMode")

    def _configure(self) -> None:
        pass  # the standard has no structural parameters

    def _announce(self) -> None:
        self.call_once("fmi2SetupExperiment", 0, 0.0, self._span[0], *self._end())

    def _attempt(self, time: float, part: float, final: bool, *, again: bool) -> int:
        return int(self._do_step(self.pointer, time, part, final))

    def _is_cut_short(self) -> bool:
        return False

    def _last_successful_time(self) -> float | None:
        ask, found = self.functions.get("fmi2GetRealStatus"), c_double(math.nan)
        status = DISCARD if ask is None else ask(self.pointer, _LAST_SUCCESSFUL_TIME, ctypes.byref(found))
        return found.value if status in (OK, WARNING) and math.isfinite(found.value) else None

    def _stops(self, status: int) -> bool:
        ask, found = self.functions.get("fmi2GetBooleanStatus"), c_int(0)
        if status != DISCARD or ask is None:
            return False
        return ask(self.pointer, _TERMINATED, ctypes.byref(found)) in (OK, WARNING) and bool(found.value)

    def directional_derivatives(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
    ) -> list[float]:
        """How the unknowns change when the knowns change by ``seed``; all are Real variables."""
        rows, columns = self.references(unknowns), self.references(knowns)
        found = (c_double * len(unknowns))()
        given = (c_double * len(knowns))(*seed)
        self.call(self.DERIVE, rows, len(unknowns), columns, len(knowns), given, found)
        return list(found)
