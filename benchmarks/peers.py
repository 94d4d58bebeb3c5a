# ruff: noqa: PLC0415 (a peer that is not installed is left out)
"""Other masters on the ring of benchmarks/ring.py, each driven the way it is fastest; all outputs recorded.

A candidate is built (set-up, not timed as stepping), then told to ``run`` more steps; ``values`` are the outputs now.
"""

from __future__ import annotations

import ctypes
import json
import logging
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave

STEP = 1e-3
_NANOSECONDS = 10**9


@dataclass(frozen=True)
class Ring:
    """FMUs of one file in a ring; the state of number k begins at ``starts[k]``."""

    path: Path
    count: int
    steps: int

    @property
    def starts(self) -> list[float]:
        return [(k + 1) / self.count for k in range(self.count)]

    def before(self, k: int) -> int:
        return k - 1 if k else self.count - 1


class Candidate(Protocol):
    def run(self, steps: int) -> None: ...

    def values(self) -> list[float]: ...


def _references(path: Path) -> tuple[Any, dict[str, int]]:
    description = fmpy.read_model_description(str(path), validate=False)
    return description, {v.name: v.valueReference for v in description.modelVariables}


def _instantiate(folder: str, description: Any, name: str) -> FMU2Slave:
    identifier = description.coSimulation.modelIdentifier
    fmu = FMU2Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier=identifier, instanceName=name)
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.0)
    return fmu


class FmpyLoop:
    """The loop that everybody writes: setReal, doStep, getReal of ``FMU2Slave``, values appended to lists."""

    def __init__(self, ring: Ring) -> None:
        folder = fmpy.extract(str(ring.path))
        description, references = _references(ring.path)
        self.u, self.x = references["u"], references["x"]
        self.fmus = []
        for k, start in enumerate(ring.starts):
            fmu = _instantiate(folder, description, f"lag{k}")
            fmu.setReal([self.x], [start])
            fmu.enterInitializationMode()
            fmu.exitInitializationMode()
            self.fmus.append(fmu)
        self.ring, self.now, self.done = ring, ring.starts, 0

    def run(self, steps: int) -> None:
        rows = []
        for _ in range(steps):
            for k, fmu in enumerate(self.fmus):
                fmu.setReal([self.u], [self.now[self.ring.before(k)]])
            for fmu in self.fmus:
                fmu.doStep(currentCommunicationPoint=self.done * STEP, communicationStepSize=STEP)
            self.now = [fmu.getReal([self.x])[0] for fmu in self.fmus]
            rows.append(self.now)
            self.done += 1

    def values(self) -> list[float]:
        return self.now


class _Container:
    """A container FMU of the whole ring, read as a whole after each step."""

    raw = False

    def __init__(self, ring: Ring) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = self.package(ring, Path(folder))
            description, references = _references(path)
            self.fmu = _instantiate(fmpy.extract(str(path)), description, "ring")
        self.references = [references[f"out{k}"] for k in range(ring.count)]
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.done = 0

    def package(self, ring: Ring, folder: Path) -> Path:
        raise NotImplementedError

    def run(self, steps: int) -> None:
        if self.raw:
            self._run_raw(steps)
            return
        rows = []
        for _ in range(steps):
            self.fmu.doStep(currentCommunicationPoint=self.done * STEP, communicationStepSize=STEP)
            rows.append(self.fmu.getReal(self.references))
            self.done += 1

    def _run_raw(self, steps: int) -> None:
        """The library's own functions through ctypes, into rows of NumPy: as fast as Python can drive it."""
        count = len(self.references)
        step, get = self.fmu.dll["fmi2DoStep"], self.fmu.dll["fmi2GetReal"]
        step.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int]
        get.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p]
        references = (ctypes.c_uint * count)(*self.references)
        rows, component = np.empty((steps, count)), self.fmu.component
        place, size = rows.ctypes.data, rows.strides[0]
        for _ in range(steps):
            if step(component, self.done * STEP, STEP, 1) or get(component, references, count, place):
                raise RuntimeError("the container failed")
            self.done += 1
            place += size

    def values(self) -> list[float]:
        return list(self.fmu.getReal(self.references))


class FmpyContainer(_Container):
    """FMPy's ``container_fmu``, with the type name that its runtime knows."""

    def package(self, ring: Ring, folder: Path) -> Path:
        from fmpy.container_fmu import Configuration
        from fmpy.container_fmu.cli import create_container_fmu
        from fmpy.container_fmu.config import Component, Connection
        from fmpy.model_description import CoSimulation, ModelDescription, ModelVariable, Unknown

        description, _ = _references(ring.path)
        inner = {v.name: v for v in description.modelVariables}
        parts = [Component(f"lag{k}", ring.path, description) for k in range(ring.count)]
        time = ModelVariable("time", 0, "Real", causality="independent", variability="continuous")
        variables, mappings = [time], {}

        def add(name: str, causality: str, k: int, target: str, start: str | None = None) -> None:
            variability = "continuous" if causality == "output" else "fixed"
            variable = ModelVariable(name, 0, "Real", causality=causality, variability=variability, start=start)
            variables.append(variable)
            mappings[variable] = [(parts[k], inner[target])]

        for k, start in enumerate(ring.starts):
            add(f"out{k}", "output", k, "x")
            add(f"x{k}", "parameter", k, "x", repr(start))
            add(f"u{k}", "parameter", k, "u", repr(ring.starts[ring.before(k)]))
        outputs = [v for v in variables if v.causality == "output"]
        outer = ModelDescription(
            fmiVersion="2.0",
            modelName="ring",
            instantiationToken="{ring}",
            variableNamingConvention="structured",
            coSimulation=CoSimulation(modelIdentifier="ring", fixedInternalStepSize=STEP),
            modelVariables=variables,
            outputs=[Unknown(variable=v) for v in outputs],
            initialUnknowns=[Unknown(variable=v) for v in outputs],
        )
        wires = [Connection(parts[ring.before(k)], [inner["x"]], parts[k], [inner["u"]]) for k in range(ring.count)]
        (folder / "unzipped").mkdir()
        create_container_fmu(
            Configuration(False, outer, parts, wires, mappings), folder / "unzipped", folder / "wrong.fmu"
        )
        with zipfile.ZipFile(folder / "wrong.fmu") as old, zipfile.ZipFile(folder / "ring.fmu", "w") as new:
            for entry in old.namelist():
                content = old.read(entry)
                if entry == "resources/container.json":
                    data = json.loads(content)
                    for connection in data["connections"]:
                        connection["variableType"] = "Float64"
                    content = json.dumps(data).encode()
                new.writestr(entry, content)
        return folder / "ring.fmu"


class FmpyContainerRaw(FmpyContainer):
    raw = True


class ToolboxContainer(_Container):
    """fmu-manipulation-toolbox's container."""

    def package(self, ring: Ring, folder: Path) -> Path:
        from fmu_manipulation_toolbox.assembly import AssemblyNode

        logging.getLogger("fmu_manipulation_toolbox").disabled = True
        node = AssemblyNode(
            "ring.fmu", step_size=STEP, sequential=False, auto_link=False, auto_input=False, auto_output=False
        )
        for k, start in enumerate(ring.starts):
            node.add_fmu(f"lag{k}", str(ring.path))
            node.add_output(f"lag{k}", "x", f"out{k}")
            node.add_start_value(f"lag{k}", "x", repr(start))
        for k in range(ring.count):
            node.add_link(f"lag{ring.before(k)}", "x", f"lag{k}", "u")
        node.make_fmu(folder)
        return folder / "ring.fmu"


class ToolboxContainerRaw(ToolboxContainer):
    raw = True


class Ecos:
    """ecospy; it can record to CSV only, which ``EcosCsv`` does for the outputs alone."""

    csv = False

    def __init__(self, ring: Ring) -> None:
        from ecospy import EcosLib, EcosSimulation, EcosSimulationStructure

        EcosLib.set_log_level("warn")
        structure = EcosSimulationStructure()
        for k in range(ring.count):
            structure.add_model(f"lag{k}", str(ring.path))
        for k in range(ring.count):
            structure.make_real_connection(f"lag{ring.before(k)}::x", f"lag{k}::u")
        structure.add_parameter_set("start", {f"lag{k}::x": start for k, start in enumerate(ring.starts)})
        self.engine = EcosSimulation(structure=structure, step_size=STEP)
        if self.csv:
            target = Path(tempfile.mkdtemp()) / "ring.csv"
            self.engine.add_csv_writer(str(target), identifiers=[f"lag{k}::x" for k in range(ring.count)])
        if not self.engine.init(parameter_set="start"):
            raise RuntimeError("it cannot be initialized")
        self.count = ring.count

    def run(self, steps: int) -> None:
        self.engine.step(steps)

    def values(self) -> list[float]:
        return [self.engine.get_real(f"lag{k}::x") for k in range(self.count)]


class EcosCsv(Ecos):
    csv = True


class Libcosim:
    """libcosimpy with its time-series observer, which keeps values in memory."""

    def __init__(self, ring: Ring) -> None:
        from libcosimpy.CosimEnums import CosimVariableType
        from libcosimpy.CosimExecution import CosimExecution
        from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
        from libcosimpy.CosimObserver import CosimObserver
        from libcosimpy.CosimSlave import CosimLocalSlave

        log_output_level(CosimLogLevel.WARNING)
        _, references = _references(ring.path)
        self.u, self.x = references["u"], references["x"]
        self.engine = CosimExecution.from_step_size(round(STEP * _NANOSECONDS))
        names = [f"lag{k}" for k in range(ring.count)]
        self.fmus = [self.engine.add_local_slave(CosimLocalSlave(str(ring.path), name)) for name in names]
        for fmu, start in zip(self.fmus, ring.starts, strict=True):
            self.engine.real_initial_value(fmu, self.x, start)
        for k, fmu in enumerate(self.fmus):
            self.engine.connect_real_variables(self.fmus[ring.before(k)], self.x, fmu, self.u)
        self.observer = CosimObserver.create_time_series(buffer_size=ring.steps)
        self.latest = CosimObserver.create_last_value()
        self.engine.add_observer(self.observer)
        self.engine.add_observer(self.latest)
        for fmu in self.fmus:
            self.observer.start_time_series(fmu, self.x, CosimVariableType.REAL)

    def run(self, steps: int) -> None:
        if not self.engine.step(steps):
            raise RuntimeError("a step failed")

    def values(self) -> list[float]:
        return [self.latest.last_real_values(fmu, [self.x])[0] for fmu in self.fmus]


PEERS: dict[str, type[Any]] = {
    "FMPy container FMU, raw ctypes into NumPy": FmpyContainerRaw,
    "FMPy container FMU, `FMU2Slave` loop": FmpyContainer,
    "fmu-manipulation-toolbox container, raw ctypes into NumPy": ToolboxContainerRaw,
    "fmu-manipulation-toolbox container, `FMU2Slave` loop": ToolboxContainer,
    "ecospy, nothing recorded": Ecos,
    "ecospy, CSV of the outputs": EcosCsv,
    "libcosimpy, time-series observer": Libcosim,
    "FMPy, the `FMU2Slave` loop everybody writes": FmpyLoop,
}
