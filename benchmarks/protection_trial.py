"""One run of benchmarks/protection_campaign.py: what is wrong in it, its system, and what is promised of it."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from railcosim.orchestrator import System, run
from railcosim.orchestrator.run.execution import Run

STUCK = f"{Path(__file__).with_name('stuck_ato.py')}:StuckAto"
WAIT, TRIP = 2.0, 190.0
MASS, SERVICE = 194295.0, 0.9
"""What the protection takes the train's mass for (kg), and the deceleration of its service brake (m/s2)."""
TRACTION, BRAKING, BRAKING_POWER = 400e3, 400e3, 8e6
STEEPEST = 0.03
"""m/s2: more than the steepest descent of the line (2.8 N/kN) pulls with."""
CHANGE = 0.06
"""m/s2: more than the line's resistance can change by (5.4 N/kN) while the train reacts."""
STANDSTILL, EASING = 0.05, 4.0
"""m/s: below this speed a braked train is held; 1/s: no brake is stronger than this times the speed."""
ALPHA, BARRIER = 8.0, 0.1

SINGLE = ("force limits", "wet rail", "heavy train", "slow sampling", "sensor noise", "full traction")
CYCLE = (*SINGLE, *["combination"] * 4)
"""Kinds of runs, in turn."""


@dataclass
class Draw:
    """What is wrong in one run.

    Attributes:
        faults: their names. step: sample period in s. late: samples by which the force comes late (0 or 1).
        lag: of the drive in s. train, ato, sensor: values that differ; no sensor where the last is empty.
        by_place: whether the limit is one over position.
    """

    number: int
    seed: int
    faults: tuple[str, ...]
    step: float = 0.01
    late: int = 0
    lag: float = 0.0
    by_place: bool = False
    train: dict[str, Any] = field(default_factory=dict)
    ato: dict[str, Any] = field(default_factory=dict)
    sensor: dict[str, Any] = field(default_factory=dict)


def draw(number: int, campaign_seed: int = 1) -> Draw:
    """The draw of a run; it depends on nothing but the two numbers."""
    chance = random.Random(f"{campaign_seed}/{number}")
    kind = CYCLE[number % len(CYCLE)]
    if kind == "combination":
        faults = tuple(sorted(chance.sample(SINGLE, chance.randint(2, len(SINGLE))), key=SINGLE.index))
    else:
        faults = (kind,)
    found = Draw(number, chance.randrange(1, 2**31), faults)
    if "force limits" in faults:
        found.train |= {"traction_limit": chance.uniform(1e5, 3e5), "braking_limit": chance.uniform(8e4, 3e5)}
        if chance.random() < 0.5:
            found.train |= {"limit_power": True, "traction_power": chance.uniform(1.5e6, 4e6)}
    if "wet rail" in faults:
        found.train |= {"limit_adhesion": True, "adhesion": chance.uniform(0.02, 0.12)}
    if "heavy train" in faults:
        found.train |= {"load_factor": 1.2}
    if "slow sampling" in faults:
        found.step = chance.choice((0.05, 0.1, 0.2, 0.5))
        found.ato |= {"check_sampling": chance.random() < 0.3}
    if "sensor noise" in faults:
        found.sensor = {
            "position_noise": chance.uniform(0.0, 0.5), "speed_noise": math.exp(chance.uniform(-4.6, -1.6)),
            "noise_hold": found.step * chance.choice((1, 1, 5)), "speed_resolution": chance.choice((0.0, 0.05, 0.1)),
            "delay": chance.choice((0, 0, 1, 2, 5)),
        }  # fmt: skip
    if "full traction" in faults:
        begin = 0.0 if chance.random() < 0.5 else chance.uniform(0.0, 150.0)
        found.ato |= {"stuck_from": begin, "stuck_force": chance.uniform(1.2e5, 4e5)}
    if chance.random() < 0.4:
        found.lag = chance.uniform(0.05, 0.8)
    found.late = int(chance.random() < 0.3)
    found.by_place = not found.sensor and chance.random() < 0.3
    return found


def system(case: Draw, *, intervene: bool) -> System:
    """The system of a run."""
    h = case.step
    made = System(stop_time=WAIT + TRIP, step=h, seed=case.seed)
    made.judged.requirements["speed_limit"] = "always monitor.largest_overspeed <= 0"
    made.add("timetable", "Timetable", sample_time=h, wait=WAIT, preview=case.late)
    ato = STUCK if "stuck_from" in case.ato else "Cailc"
    made.add("ato", ato, **{"sample_time": h, "delay": case.late, "alpha": ALPHA, "barrier": BARRIER} | case.ato)
    made.add("protection", "Protection", intervene=intervene, by_place=case.by_place)
    limits = {"limit_force": True, "traction_limit": TRACTION, "braking_limit": BRAKING}
    made.add("train", "SubwayTrain", **limits | {"actuator_lag": case.lag} | case.train)
    made.add("monitor", "TripMonitor")
    if case.sensor:
        made.add("sensor", "Sensor", **case.sensor)
    for name in ("trip", "trip_time"):
        for target in ("ato", "train", "monitor", *(["protection"] if name == "trip_time" else [])):
            made.connect(f"timetable.{name}", f"{target}.{name}")
    for name in ("reference_position", "reference_speed", "reference_acceleration", "speed_limit"):
        made.connect(f"timetable.{name}", f"ato.{name}")
    for name in ("position", "speed"):
        if case.sensor:
            made.connect(f"train.{name}", f"sensor.true_{name}")
        for target in ("ato", "protection"):
            made.connect(f"{'sensor' if case.sensor else 'train'}.{name}", f"{target}.{name}")
    made.connect("ato.force", "protection.demanded_force")
    made.connect("protection.force", "train.force", delay=case.late)
    made.connect("train.speed", "monitor.speed")
    made.connect("protection.speed_limit", "monitor.speed_limit")
    return made


class Trip:
    """The recorded trip, aligned: element k of each array belongs to the sample at the departure and k samples.

    What a sampled block computes from its inputs is reported one row after them.
    """

    def __init__(self, outcome: Run, case: Draw) -> None:
        def now(name: str) -> Any:
            return np.asarray(outcome[name])[first:-1]

        def computed(name: str) -> Any:
            return np.asarray(outcome[name])[first + 1 :]

        first = round(WAIT / case.step)
        assert abs(outcome["timetable.trip_time"][first]) < 1e-9
        self.case = case
        self.speed = now("train.speed")
        self.limit = computed("protection.speed_limit")
        self.over = self.speed - self.limit
        self.force, self.brake = computed("protection.force"), computed("protection.service_brake").astype(bool)
        self.demanded = computed("ato.force")
        self.acceleration = computed("train.acceleration")
        seen = computed if case.sensor else now
        source = "sensor" if case.sensor else "train"
        self.measured = seen(f"{source}.speed")
        self.seen_error = ALPHA * (seen(f"{source}.position") - now("timetable.reference_position"))
        self.seen_error = self.seen_error + (self.measured - now("timetable.reference_speed"))
        self.true_error = ALPHA * (now("train.position") - now("timetable.reference_position"))
        self.true_error = self.true_error + (self.speed - now("timetable.reference_speed"))
        self.reached, self.status = computed("ato.barrier_reached").astype(bool), computed("ato.status")

    @property
    def delay(self) -> int:
        """Of the sensor, in samples."""
        return int(self.case.sensor.get("delay", 0))

    def sensor_error(self) -> float:
        """Largest error of a measured speed against the true one of as many samples ago as the sensor is late."""
        if not self.case.sensor:
            return 0.0
        d = self.delay
        return float(np.abs(self.measured[d:] - self.speed[: len(self.speed) - d]).max())

    def first_brake(self) -> int | None:
        """The sample at which the brake is called for first."""
        return int(np.argmax(self.brake)) if self.brake.any() else None


def drive_force(trip: Trip, at: int) -> float:
    """Force of a drive that lags, at a sample, in N: its command, limited, through a first-order lag."""
    case, state = trip.case, 0.0
    share = 1.0 - math.exp(-case.step / case.lag)
    low, high = -case.train.get("braking_limit", BRAKING), case.train.get("traction_limit", TRACTION)
    for k in range(max(0, at - round(12.0 * case.lag / case.step)), at):
        command = trip.force[k - case.late] if k >= case.late else 0.0
        command = min(max(command, low), high)
        if case.train.get("limit_power"):
            v = max(trip.speed[k], 0.1)
            command = min(max(command, -BRAKING_POWER / v), case.train["traction_power"] / v)
        state += share * (command - state)
    return state


def reaction(trip: Trip, k: int) -> tuple[float, float]:
    """Reaction time in s for a brake called for at sample k, and the time the drive then needs to turn its force."""
    case = trip.case
    begin = (1 + trip.delay + case.late) * case.step
    if not case.lag:
        return begin, 0.0
    heavy = MASS * case.train.get("load_factor", 1.0)
    brake = min(SERVICE * MASS, case.train.get("braking_limit", BRAKING), BRAKING_POWER / max(trip.speed[k], 1.0))
    pull = STEEPEST * heavy
    drive = max(drive_force(trip, k + case.late), -pull)
    return begin, case.lag * math.log((drive + brake) / (brake - pull))


def bound(trip: Trip) -> float:
    """Largest excess over the limit in m/s that reaction time and braking rate allow; docs/protection_campaign.md."""
    error, k = trip.sensor_error(), trip.first_brake()
    if k is None:
        return error
    case, late = trip.case, trip.case.late
    before = max(k - 1 - trip.delay, 0)
    begin, turning = reaction(trip, k)
    growth = max(0.0, float(trip.acceleration[before : k + late + 1].max()) + CHANGE) * (begin + turning)
    base = max(error, float((trip.speed[before] - trip.limit[before : k + 1]).max()))
    found = base + growth
    drops = np.flatnonzero(np.diff(trip.limit) < 0.0) + 1
    for j in drops[drops > k]:  # the brake acts: what the limit falls by remains
        grown = growth if (j - k) * case.step <= begin + turning else 0.0
        found = max(found, float(trip.speed[j - 1] - trip.limit[j]) + grown)
    return found


@dataclass
class Outcome:
    """One run, with or without protection.

    Attributes:
        peak: largest excess over the limit in m/s, negative where it was kept. bound: what it promises to stay under.
        braked_at: trip time in s at which the service brake was called for first.
        left_barrier: whether the augmented error that the ATO sees left its barrier; left_unseen: whether only the true
            one did, which a noisy sensor hides. violation: whether the limit was exceeded.
        rocking: largest speed in m/s, either way, after a braked train first stood. broken: promises not kept.
    """

    peak: float
    bound: float
    braked_at: float | None
    left_barrier: bool
    left_unseen: bool
    violation: bool
    rocking: float
    broken: list[str]
    digest: Any = None


def judge(outcome: Run, case: Draw, *, intervene: bool) -> Outcome:
    """Compare what was recorded with what is promised."""
    trip = Trip(outcome, case)
    broken = []
    if (trip.brake < (trip.measured > trip.limit)).any():
        broken.append("no brake command within one sample of measured speed > limit")
    d, error = trip.delay, trip.sensor_error()
    late = trip.speed[: len(trip.speed) - d] > trip.limit[: len(trip.speed) - d] + error + 1e-12
    if (late & ~trip.brake[d:]).any() and not _limit_rises(trip):
        broken.append("true speed > limit + sensor error, and no brake command within one sample and the delay")
    k = trip.first_brake()
    peak, allowed, rocking = float(trip.over.max()), math.inf, 0.0
    if intervene:
        allowed = bound(trip)
        if peak > allowed + 1e-9:
            broken.append(f"peak {peak:.6f} above its bound {allowed:.6f}")
        if k is not None:
            moving = trip.measured[k:] > 0.5
            if (trip.force[k:][moving] > -SERVICE * MASS * 0.999).any():
                broken.append("a brake that was called for does not act")
            eased = np.maximum(trip.demanded[k:], -EASING * MASS * trip.measured[k:])
            if (trip.force[k:] > eased + 1e-9 * MASS)[trip.measured[k:] > STANDSTILL].any():
                broken.append("the protection brakes less than the ATO would")
            if not trip.brake[k:].all():
                broken.append("the brake was released")
            stood = np.flatnonzero(trip.speed[k:] < STANDSTILL)
            if len(stood):
                rocking = float(np.abs(trip.speed[k + stood[0] :]).max())
            slow = np.flatnonzero(trip.measured[k:] < 0.5)
            end = k + slow[0] if len(slow) else None
            if (np.diff(trip.speed[_settled(trip, k) : end]) > 0.0).any():
                broken.append("a braked train gains speed")
    violation, reported = peak > 0.0, outcome.requirements[0].verdict == "fail"
    if violation != reported:
        broken.append("the requirement does not say whether the limit was kept")
    outside = np.abs(trip.seen_error) >= BARRIER
    if (outside & ~(trip.reached & (trip.status >= 2))).any() or outside.any() != trip.reached.any():
        broken.append("the barrier's flag and status do not say whether it was left")
    really = bool((np.abs(trip.true_error) >= BARRIER).any())
    return Outcome(
        peak, allowed, None if k is None else k * case.step, bool(outside.any()), really and not outside.any(),
        violation, rocking, broken, (k, trip.speed),
    )  # fmt: skip


def _limit_rises(trip: Trip) -> bool:
    """Whether a limit rises within the sensor's delay of an excess, which the sensor then need not have seen."""
    rises = np.flatnonzero(np.diff(trip.limit) > 0.0) + 1
    return any((trip.over[max(0, j - trip.delay) : j] > 0.0).any() for j in rises)


def _settled(trip: Trip, k: int) -> int:
    """The sample from which a brake called for at sample k acts in full."""
    return k + 2 + trip.case.late + math.ceil(8.0 * trip.case.lag / trip.case.step)


def trial(number: int, campaign_seed: int, *, paired: bool) -> tuple[Draw, Outcome, Outcome | None]:
    """One draw, run with the protection, and without it where that is asked for."""
    case = draw(number, campaign_seed)
    with_it = judge(run(system(case, intervene=True)), case, intervene=True)
    if not paired:
        return case, with_it, None
    without = judge(run(system(case, intervene=False)), case, intervene=False)
    (k, speed), (other, free) = with_it.digest, without.digest
    same = len(speed) if k is None else k + 1 + case.late
    if k != other or not np.array_equal(speed[:same], free[:same]):
        without.broken.append("the paired runs differ before the brake is called for")
    return case, with_it, without
