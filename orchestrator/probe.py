"""One probe of one FMU, run by `validate` as a script in a process of its own, which the FMU may take down.

It imports nothing of this project, so that it starts quickly; what it needs to know stands in the JSON file named as
its only argument, and it writes its verdict to the file named in there.
"""

from __future__ import annotations

import ctypes
import json
import math
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fmpy import fmi2
from fmpy.fmi1 import FMICallException
from fmpy.logging import addLoggerProxy

STATUS = ("ok", "warning", "discard", "error", "fatal", "pending")
STEPS = 20
_ERROR, _FATAL = 3, 4
_UNKNOWN_REFERENCE = 4_000_000_000
_KEPT = 5


class RefusedError(Exception):
    """The FMU answered a call it has to accept with an error, or gave a value that is none."""


class DoubtfulError(Exception):
    """Something that works, though the standard says it should not."""


class Instance:
    """One instance, driven by bare FMI calls.

    Args:
        spec: what the FMU is: folder, library, guid, identifier, variables, step.
        name: of the instance.
    """

    def __init__(self, spec: dict[str, Any], name: str = "probe") -> None:
        self.spec = spec
        self.log: list[str] = []
        self.time = float(spec["start_time"])
        self.dead = False
        self._logger = fmi2.fmi2CallbackLoggerTYPE(self._hear)
        self._callbacks = fmi2.fmi2CallbackFunctions()
        self._callbacks.logger = self._logger
        self._callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
        self._callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
        addLoggerProxy(ctypes.byref(self._callbacks))
        make: Any = fmi2.FMU2Slave
        self.fmu = make(
            guid=spec["guid"],
            unzipDirectory=spec["folder"],
            modelIdentifier=spec["identifier"],
            instanceName=name,
            libraryPath=spec["library"],
        )
        try:
            self.fmu.instantiate(callbacks=self._callbacks, loggingOn=spec["talks"])
        except Exception as error:
            raise RefusedError(self._told(f"it cannot be instantiated: {error}")) from error

    def _hear(self, _: Any, name: bytes, status: int, category: bytes, message: bytes) -> None:
        self.log.append((message or b"").decode(errors="replace").strip())

    def _told(self, text: str) -> str:
        said = [line for line in self.log if line][-_KEPT:]
        return f"{text}; it said: {' / '.join(said)}" if said else text

    def status(self, call: str, *arguments: Any) -> int:
        """Make a call for its status alone."""
        function = getattr(self.fmu, call)
        try:
            function(*arguments)
        except FMICallException as error:
            self.dead = self.dead or error.status >= _FATAL
            return int(error.status)
        return 0

    def call(self, call: str, *arguments: Any) -> Any:
        """Make a call that has to succeed."""
        try:
            return getattr(self.fmu, call)(*arguments)
        except FMICallException as error:
            status = int(error.status)
            self.dead = self.dead or status >= _FATAL
            label = STATUS[status] if 0 <= status < len(STATUS) else str(status)
            raise RefusedError(self._told(f"{call} at t = {self.time:g} s gave {label}")) from error

    def initialize(self) -> Instance:
        """Instantiated -> ready to step."""
        self.time = float(self.spec["start_time"])
        self.call("setupExperiment", None, self.time, None)
        self.call("enterInitializationMode")
        self.call("exitInitializationMode")
        return self

    def read(self) -> list[Any]:
        """All outputs.

        Raises:
            RefusedError: one is not finite.
        """
        values: list[Any] = []
        for kind, variables in self.spec["outputs"].items():
            found = self.call(f"get{_SETTER.get(kind, kind)}", [reference for _, reference in variables])
            for (name, _), value in zip(variables, found, strict=True):
                if kind == "Real" and not math.isfinite(value):
                    raise RefusedError(self._told(f"output {name} is {value!r} at t = {self.time:g} s"))
                values.append(value.decode(errors="replace") if isinstance(value, bytes) else value)
        return values

    def run(self, steps: int = STEPS) -> list[list[Any]]:
        """Take steps; all outputs after each."""
        rows = []
        begin = self.time
        for k in range(steps):
            self.call("doStep", self.time, self.spec["step"])
            self.time = begin + (k + 1) * self.spec["step"]
            rows.append(self.read())
        return rows


_SETTER = {"Enumeration": "Integer"}


@contextmanager
def instances(spec: dict[str, Any], count: int = 1) -> Iterator[list[Instance]]:
    """Some instances, freed at the end, unless one failed fatally."""
    made = [Instance(spec, f"probe{k}") for k in range(count)]
    yield made
    for instance in made:
        if not instance.dead:
            instance.fmu.freeInstance()


def instantiate(spec: dict[str, Any]) -> str:
    """Load, instantiate and free, again and again where that is allowed."""
    again = 1 if spec["single"] else 20
    for _ in range(again):
        with instances(spec):
            pass
    return f"instantiated and freed {again} time{'s' * (again > 1)}"


def simulate(spec: dict[str, Any]) -> str:
    """Initialize with start values, step, read every output, terminate."""
    with instances(spec) as (it,):
        it.initialize()
        it.read()
        rows = it.run()
        it.call("terminate")
    return f"{STEPS} steps of {spec['step']:g} s, {len(rows[0])} outputs finite"


def starts(spec: dict[str, Any]) -> str:
    """Parameters and inputs have the start values that the description says."""
    with instances(spec) as (it,):
        it.initialize()
        for kind, name, reference, expected in spec["starts"]:
            (found,) = it.call(f"get{_SETTER.get(kind, kind)}", [reference])
            found = found.decode(errors="replace") if isinstance(found, bytes) else found
            if found != expected:
                raise RefusedError(f"{name} starts at {found!r}, not at {expected!r} as described")
    return f"{len(spec['starts'])} parameters and inputs start as described"


def reset(spec: dict[str, Any]) -> str:
    """Reset and run again: the same numbers."""
    with instances(spec) as (it,):
        first = it.initialize().run()
        it.call("reset")
        second = it.initialize().run()
        compare(first, second, "after fmi2Reset")
    return "a run after fmi2Reset repeats the first, bit for bit"


def second_instance(spec: dict[str, Any]) -> str:
    """Two instances, stepped in turn, do not disturb one another."""
    if spec["single"]:
        return "skipped: can be instantiated only once per process"
    with instances(spec) as (alone,):
        expected = alone.initialize().run()
    with instances(spec, 2) as (a, b):
        a.initialize()
        b.initialize()
        rows: list[list[Any]] = []
        for _ in range(STEPS):
            rows += a.run(1)
            b.run(1)
        compare(expected, rows, "beside a second instance")
    return "two instances stepped in turn give what one gives alone"


def state(spec: dict[str, Any]) -> str:
    """Get, set, serialize and deserialize the state, where the description says that it can."""
    if not spec["can_save"]:
        return "skipped: does not say that it can get and set its state"
    with instances(spec) as (it,):
        it.initialize().run(STEPS // 2)
        saved, time = it.call("getFMUState"), it.time
        expected = it.run(STEPS // 2)
        it.call("setFMUState", saved)
        it.time = time
        compare(expected, it.run(STEPS // 2), "after fmi2SetFMUstate")
        if spec["can_serialize"]:
            data = it.call("serializeFMUState", saved)
        it.call("freeFMUState", saved)
    if not spec["can_serialize"] or spec["single"]:
        return "a run from a restored state repeats the first"
    with instances(spec) as (it,):
        it.initialize()
        restored = it.call("deSerializeFMUstate", data)
        it.call("setFMUState", restored)
        it.call("freeFMUState", restored)
        it.time = time
        compare(expected, it.run(STEPS // 2), "from a serialized state")
    return "a run from a restored or serialized state repeats the first"


def order(spec: dict[str, Any]) -> str:
    """Calls in a wrong order or with wrong arguments get an error."""
    accepted = []
    step, unknown = spec["step"], [_UNKNOWN_REFERENCE]
    wrong: list[tuple[str, bool, str, tuple[Any, ...]]] = [
        ("fmi2DoStep before initialization", False, "doStep", (spec["start_time"], step)),
        ("fmi2ExitInitializationMode out of turn", False, "exitInitializationMode", ()),
        ("fmi2EnterInitializationMode while running", True, "enterInitializationMode", ()),
        ("fmi2GetReal of a value reference that is not there", True, "getReal", (unknown,)),
        ("fmi2SetReal of a value reference that is not there", True, "setReal", (unknown, [0.0])),
        ("fmi2DoStep with a negative step", True, "doStep", (spec["start_time"], -step)),
    ]
    for what, initialized, call, arguments in wrong:
        Path(spec["trying"]).write_text(what, encoding="utf-8")
        with instances(spec) as (it,):
            if initialized:
                it.initialize()
            if it.status(call, *arguments) < _ERROR - 1:  # a discard is a refusal too
                accepted.append(what)
    if accepted:
        raise DoubtfulError(f"accepted without an error: {', '.join(accepted)}")
    return f"{len(wrong)} wrong calls got an error"


def compare(expected: list[list[Any]], found: list[list[Any]], where: str) -> None:
    """Refuse rows of outputs that are not as expected."""
    for k, (a, b) in enumerate(zip(expected, found, strict=True)):
        if a != b:
            raise RefusedError(f"other outputs {where}: at step {k + 1}, {a!r} became {b!r}")


PROBES: dict[str, Callable[[dict[str, Any]], str]] = {
    "instantiate": instantiate,
    "simulate": simulate,
    "starts": starts,
    "reset": reset,
    "instances": second_instance,
    "state": state,
    "order": order,
}


def main(path: str, probes: dict[str, Callable[[dict[str, Any]], str]] = PROBES) -> None:
    """Run the probe that the file asks for, and write its verdict."""
    spec = json.loads(Path(path).read_text(encoding="utf-8"))
    try:
        detail = probes[spec["probe"]](spec)
        verdict = "skipped" if detail.startswith("skipped: ") else "pass"
    except DoubtfulError as error:
        verdict, detail = "warning", str(error)
    except RefusedError as error:
        verdict, detail = "fail", str(error)
    except Exception as error:  # FMPy could not load the library, or has no such function
        verdict, detail = "fail", f"{type(error).__name__}: {error}"
    answer = {"verdict": verdict, "detail": detail.removeprefix("skipped: ")}
    Path(spec["answer"]).write_text(json.dumps(answer), encoding="utf-8")
    # A library that crashes while it is unloaded has done its part by now (pythonfmu 0.7 does, in one exit of a few).
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1])
