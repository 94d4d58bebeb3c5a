"""Timetable, controller and train as a `System` by hand: the three units of the specification's section 9.

Load it by its path; it needs no scenario file, so that sampling, delay and faults can be varied freely.
"""

import numpy as np
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System

AS_STATED = {"learning_gain": [100.0, 0.01, 0.01], "limit_estimate": False}
RUN, WAIT = 190.0, 10.0


class Trips:
    """A run of several trips, and what each of them was like.

    Args:
        trips: how many. step: of communication and control, s. algorithm: ``"jacobi"`` delays the loop by one sample.
        ato, train: components, with values for each in ``law`` and ``plant``; ``build``: the train's build arguments.
        table: values of the timetable. sensor: values of a sensor between train and controller, if there is to be one.
        record: distance of recorded points, s; the step where left out. kind: of the FMUs.
    """

    def __init__(
        self, trips, *, step=0.01, algorithm="gauss-seidel", ato="Cailc", train="SubwayTrain", law=None, plant=None,
        build=None, table=None, sensor=None, record=None, kind="auto",
    ):  # fmt: skip
        self.trips, self.step = trips, step
        self.cycle = (round((RUN + WAIT) / step) + 1) * step
        delay = int(algorithm == "jacobi")
        # A little more than the trips, so that the last one has ended for the monitor too.
        stop = round((trips * self.cycle + 4 * step) / step) * step
        system = System(stop_time=stop, step=step, algorithm=algorithm, record=record)
        system.add("timetable", "Timetable", sample_time=step, **{"preview": delay} | (table or {}))
        own = {"sample_time": step} | ({"delay": delay} if ato == "Cailc" else {})
        system.add("ato", ato, **own | (law or {}))
        system.add("train", train, build=build or {}, **(plant or {}))
        system.add("monitor", "TripMonitor")
        for name in ("trip", "trip_time"):
            for target in ("ato", "train", "monitor"):
                system.connect(f"timetable.{name}", f"{target}.{name}")
        for name in ("reference_position", "reference_speed", "reference_acceleration", "speed_limit"):
            system.connect(f"timetable.{name}", f"ato.{name}")
        if sensor is not None:
            system.add("sensor", "Sensor", **sensor)
        for name in ("position", "speed"):
            if sensor is not None:
                system.connect(f"train.{name}", f"sensor.true_{name}")
            system.connect(f"{'train' if sensor is None else 'sensor'}.{name}", f"ato.{name}")
        system.connect("ato.force", "train.force")
        for name in ("position_error", "speed_error", "augmented_error"):
            system.connect(f"ato.{name}", f"monitor.{name}")
        system.connect("train.speed", "monitor.speed")
        system.connect("timetable.speed_limit", "monitor.speed_limit")
        self.result = run(system, kind=kind)

    def __getitem__(self, name):
        return self.result[name]

    def largest(self, name, trip):
        """The largest ``position_error``, ``speed_error``, ``augmented_error`` or ``overspeed`` of a trip."""
        time = self.result.time
        k = min(int(np.searchsorted(time, trip * self.cycle + 2.5 * self.step)), len(time) - 1)
        return float(self.result[f"monitor.finished_{name}"][k])

    def during(self, name, trip):
        """A recorded signal from departure to arrival."""
        time, begin = self.result.time, (trip - 1) * self.cycle + WAIT
        return self.result[name][(time > begin - 1e-6) & (time < begin + RUN + 1e-6)]
