"""An FMI 3.0 co-simulation FMU behind the face of an instance."""

from __future__ import annotations

import ctypes
import math
import os
from collections.abc import Sequence
from ctypes import c_bool, c_char_p, c_double, c_int, c_size_t, c_uint8, c_void_p
from pathlib import Path
from typing import Any

from fmpy import fmi3

from .arrays import whole_arrays
from .libraries import Signatures
from .loaded import LoadedSlave
from .messages import keep_message
from .stepping import DISCARD, OK, WARNING

_MOST_UPDATES = 1000
"""Updates of discrete states at one event, after which they count as never settling."""
_NUMBERS = {
    "Float32": ctypes.c_float,
    "Float64": ctypes.c_double,
    "Int8": ctypes.c_int8,
    "UInt8": ctypes.c_uint8,
    "Int16": ctypes.c_int16,
    "UInt16": ctypes.c_uint16,
    "Int32": ctypes.c_int32,
    "UInt32": ctypes.c_uint32,
    "Int64": ctypes.c_int64,
    "UInt64": ctypes.c_uint64,
}


def _log(environment: int | None, status: int, category: bytes, message: bytes) -> None:
    keep_message((environment,), status, message)


_LOGGER = fmi3.fmi3LogMessageCallback(_log)
_SIGNATURES: Signatures = {
    "fmi3InstantiateCoSimulation": (
        c_void_p, c_char_p, c_char_p, c_char_p, c_bool, c_bool, c_bool, c_bool, c_void_p, c_size_t, c_void_p,
        fmi3.fmi3LogMessageCallback, c_void_p
    ),
    "fmi3FreeInstance": (None, c_void_p),
    "fmi3EnterConfigurationMode": (c_int, c_void_p),
    "fmi3ExitConfigurationMode": (c_int, c_void_p),
    "fmi3EnterInitializationMode": (c_int, c_void_p, c_bool, c_double, c_double, c_bool, c_double),
    "fmi3ExitInitializationMode": (c_int, c_void_p),
    "fmi3Terminate": (c_int, c_void_p),
    "fmi3Reset": (c_int, c_void_p),
    "fmi3EnterEventMode": (c_int, c_void_p),
    "fmi3UpdateDiscreteStates": (c_int, *[c_void_p] * 7),
    "fmi3EnterStepMode": (c_int, c_void_p),
    "fmi3GetOutputDerivatives": (c_int, c_void_p, c_void_p, c_size_t, c_void_p, c_void_p, c_size_t),
    "fmi3DoStep": (c_int, c_void_p, c_double, c_double, c_bool, c_void_p, c_void_p, c_void_p, c_void_p),
    **{
        f"fmi3{verb}{suffix}": (c_int, c_void_p, c_void_p, c_size_t, c_void_p, c_size_t)
        for verb in ("Set", "Get")
        for suffix in (*_NUMBERS, "Boolean", "String")
    },
    **{
        f"fmi3{verb}Binary": (c_int, c_void_p, c_void_p, c_size_t, c_void_p, c_void_p, c_size_t)
        for verb in ("Set", "Get")
    },
    "fmi3GetFMUState": (c_int, c_void_p, c_void_p),
    "fmi3SetFMUState": (c_int, c_void_p, c_void_p),
    "fmi3FreeFMUState": (c_int, c_void_p, c_void_p),
    "fmi3SerializedFMUStateSize": (c_int, c_void_p, c_void_p, c_void_p),
    "fmi3SerializeFMUState": (c_int, c_void_p, c_void_p, c_void_p, c_size_t),
    "fmi3DeserializeFMUState": (c_int, c_void_p, c_void_p, c_size_t, c_void_p),
    "fmi3GetDirectionalDerivative": (
        c_int, c_void_p, c_void_p, c_size_t, c_void_p, c_size_t, c_void_p, c_size_t, c_void_p, c_size_t
    ),
}  # fmt: skip
_TYPES: dict[str, tuple[str, Any]] = {
    **{name: (name, c_type) for name, c_type in _NUMBERS.items()},
    "Enumeration": ("Int64", ctypes.c_int64),
    "Boolean": ("Boolean", c_uint8),  # a byte, of which any bit is true
    "String": ("String", c_char_p),
    "Binary": ("Binary", c_void_p),
}


class Told(ctypes.Structure):
    """How a step went, beside its status; the compiled loop writes it as well."""

    _fields_ = (("waits", c_bool), ("ends", c_bool), ("early", c_bool), ("reached", c_double))


class Fmi3Slave(LoadedSlave):
    """An FMI 3.0 FMU loaded into this process."""

    SIGNATURES, TYPES = _SIGNATURES, _TYPES
    SET, GET, DO_STEP = "fmi3Set", "fmi3Get", "fmi3DoStep"
    TERMINATE, RESET, FREE = "fmi3Terminate", "fmi3Reset", "fmi3FreeInstance"
    DERIVE = "fmi3GetDirectionalDerivative"
    STATE = (
        "fmi3GetFMUState",
        "fmi3SetFMUState",
        "fmi3FreeFMUState",
        "fmi3SerializedFMUStateSize",
        "fmi3SerializeFMUState",
        "fmi3DeserializeFMUState",
    )
    COUNTS_VALUES = True

    def _instantiate(self, folder: Path) -> int | None:
        # What fmi3DoStep tells beside its status; the first, that an event waits to be handled, is for the event mode.
        self.told = Told()
        places = (getattr(Told, name).offset for name, _ in Told._fields_)
        self._telling = tuple(ctypes.byref(self.told, place) for place in places)
        resources = folder / "resources"
        place = f"{resources}{os.sep}".encode() if resources.is_dir() else None
        name, token = self.name.encode(), self.interface.guid.encode()
        # Visible, logging, event mode, early return: of an FMU that can take the rest of the step afterwards.
        options = (False, self._talks, self._events, self.interface.variable_step)
        found: int | None = self.function("fmi3InstantiateCoSimulation")(
            name, token, place, *options, None, 0, id(self), _LOGGER, None
        )
        return found

    def _configure(self) -> None:
        given = self.interface.structure
        if not given:
            return
        self.call_once("fmi3EnterConfigurationMode")
        for name, value in given.items():
            self.channel(self.interface.variables[name].type, [name]).set([value])
        self.call_once("fmi3ExitConfigurationMode")

    def enter_initialization(self) -> None:
        """Enter initialization mode; what the last step of another run told is no more."""
        self.told.waits = False
        self.call_once("fmi3EnterInitializationMode", False, 0.0, self._span[0], *self._end())

    def exit_initialization(self) -> None:
        """Leave initialization mode, and the event mode it leads to: the first step may follow."""
        self.call_once("fmi3ExitInitializationMode")
        if self._events:
            self._leave_events()

    def _leave_events(self) -> None:
        """Event mode -> step mode."""
        needed, others, until = c_bool(True), (c_bool * 3)(), c_double()
        places = [ctypes.byref(others, k * ctypes.sizeof(c_bool)) for k in range(len(others))]
        told = ctypes.byref(needed), self._telling[1], *places, ctypes.byref(until)
        for _ in range(_MOST_UPDATES):
            self.call("fmi3UpdateDiscreteStates", *told)
            if self.told.ends:
                return
            if not needed.value:
                break
        else:
            raise self.refuse(f"its discrete states do not settle in {_MOST_UPDATES} calls of fmi3UpdateDiscreteStates")
        self.call("fmi3EnterStepMode")

    def _announce(self) -> None:
        pass  # entering initialization mode says it all

    def _attempt(self, time: float, part: float, final: bool, *, again: bool) -> int:
        self.told.ends = self.told.early = False
        self.told.reached = math.nan
        status = int(self._do_step(self.pointer, time, part, final, *self._telling))
        if self._events and status in (OK, WARNING) and self.told.waits and not self.told.ends:
            self.call("fmi3EnterEventMode")
            self._leave_events()
        return status

    def _is_cut_short(self) -> bool:
        return bool(self.told.ends or self.told.early)

    def _last_successful_time(self) -> float | None:
        return float(self.told.reached) if math.isfinite(self.told.reached) else None

    def _stops(self, status: int) -> bool:
        return status in (OK, WARNING, DISCARD) and bool(self.told.ends)

    def directional_derivatives(
        self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]
    ) -> list[float]:
        """How the unknowns change when the knowns change by ``seed``; all are Real variables."""
        all_unknowns, all_knowns = whole_arrays(unknowns, self.interface), whole_arrays(knowns, self.interface)
        rows, columns = self.references(all_unknowns), self.references(all_knowns)
        found, seeds = (c_double * len(all_unknowns))(), dict(zip(knowns, seed, strict=True))
        given = (c_double * len(all_knowns))(*(seeds.get(name, 0.0) for name in all_knowns))
        self.call(self.DERIVE, rows, len(rows), columns, len(columns), given, len(given), found, len(found))
        by_name = dict(zip(all_unknowns, found, strict=True))
        return [by_name[name] for name in unknowns]
