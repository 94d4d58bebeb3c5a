"""Closely spaced trains, a radio that is not perfect, and a leader that brakes to a stand: does the margin hold?

    python benchmarks/radio_campaign.py --runs 500 --seed 1           # the table of docs/radio_campaign.md
    python benchmarks/radio_campaign.py --runs 500 --no-fallback      # only what happens without the fallback
    python benchmarks/radio_campaign.py --runs 100 --reserve 0.5 --reserve 1 --reserve 2   # where it stops holding
    python benchmarks/radio_campaign.py --only 17                     # run 17 alone

Every run is drawn from (seed, number) alone and simulated once for each variant, with the same radio luck. The braking
margin is `braking_margin` of docs/metrics.md over all gaps and all communication points. The exit code is 1 when it
goes negative with the fallback.
"""

import argparse
import csv
import math
import multiprocessing
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from railcosim.orchestrator.run.execution import run
from railcosim.orchestrator.system import System

PARTS = Path(__file__).with_name("braking_leader.py")
STEP = 0.1
BRAKING = 0.9
"""m/s2: braking every follower is sure to reach; its law and the fallback ask for no more."""
HARDEST = 1.0
"""m/s2: hardest braking of any train: the leader's at most, and all that the followers' brakes can do."""
STANDSTILL = 220.0
"""m: a train of 200 m, and 20 m behind it."""
RESERVE = 2.0
"""s: time gap beyond the braking distance that the trains keep and start with."""
LAWS = ("TunablePotentialCruise", "FixedDistanceCruise")
GAINS: dict[str, dict[str, float]] = {
    "TunablePotentialCruise": {"pull_limit": 0.1, "gap_width": 50.0, "gap_tolerance": 50.0, "gap_base": STANDSTILL},
    "FixedDistanceCruise": {"gap_gain": 0.001},
}
COMMON = {"k": 0.001, "alpha": 0.8, "rho": 0.3, "acceleration_limit": BRAKING}
FALLBACK = {"braking": BRAKING, "ahead_braking": HARDEST, "standstill_gap": STANDSTILL, "reaction_time": 1.0}
VARIANTS: dict[str, dict[str, bool]] = {
    "perfect radio, no fallback": {"perfect": True, "fallback": False},
    "no fallback": {"fallback": False},
    "fallback": {},
    "fallback and guard": {"guard": True},
}
SAFE = ("fallback", "fallback and guard")


@dataclass(frozen=True)
class Draw:
    """What a run is made of: times in s, speed in m/s, strength in m/s2."""

    seed: int
    number: int
    law: str
    trains: int
    speed: float
    brake_time: float
    strength: float
    delay: float
    jitter: float
    refresh: float
    loss: float
    """Share of messages lost, outages apart."""
    burst: float
    """Mean length of a burst of losses, in messages; 0 where each message is lost by itself."""
    outage: float
    silences: tuple[float, ...]
    """When the outage of each pair of neighbours begins."""


def draw(seed: int, number: int) -> Draw:
    """Run ``number`` of the campaign ``seed``."""
    rng = np.random.default_rng([seed, number])
    trains = int(rng.integers(4, 7))
    brake_time = float(rng.uniform(20.0, 40.0))
    silences = brake_time + rng.uniform(-2.5, 3.0, trains - 1)
    if rng.random() < 0.5:
        silences[:] = silences[0]  # all at once
    return Draw(
        seed=seed,
        number=number,
        law=LAWS[number % len(LAWS)],
        trains=trains,
        speed=float(rng.uniform(30.0, 60.0)),
        brake_time=brake_time,
        strength=float(rng.uniform(0.5, HARDEST)),
        delay=float(rng.uniform(0.0, 0.5)),
        jitter=float(rng.uniform(0.0, 0.2)),
        refresh=float(rng.choice([0.1, 0.2, 0.3])),
        loss=float(rng.uniform(0.0, 0.2)),
        burst=float(rng.uniform(1.5, 4.0)) if rng.random() < 0.5 else 0.0,
        outage=float(rng.uniform(0.0, 2.0)),
        silences=tuple(float(begin) for begin in silences),
    )


def gap(speed: float, reserve: float) -> float:
    """Gap to keep at a speed, front to front, m: braking margin 0 where the reserve is."""
    return STANDSTILL + reserve * speed + 0.5 * speed * speed * (1.0 / BRAKING - 1.0 / HARDEST)


def gains(law: str, speed: float, reserve: float) -> dict[str, float]:
    if law in ("DistributedMpc", "TimeHeadwayCruise"):  # of predictive_campaign.py
        policy = {"time_headway": (gap(speed, reserve) - STANDSTILL) / speed}
        return policy | ({"gap_margin": 0.0} if law == "DistributedMpc" else {"acceleration_limit": BRAKING})
    if law == "FixedDistanceCruise":
        policy = {"desired_gap": gap(speed, reserve)}
    else:
        policy = {"gap_time": reserve, "gap_braking": 1.0 / (1.0 / BRAKING - 1.0 / HARDEST)}
    return COMMON | GAINS[law] | policy


def system_of(
    drawn: Draw, *, reserve: float = RESERVE, perfect: bool = False, fallback: bool = True, guard: bool = False
) -> System:
    """The platoon of a draw; ``train[1]`` is the leader."""
    stop = math.ceil(drawn.brake_time + drawn.speed / drawn.strength + 30.0)
    system = System(stop_time=float(stop), step=STEP, seed=drawn.seed * 1_000_003 + drawn.number)
    leader = {"cruising_speed": drawn.speed, "brake_time": drawn.brake_time, "strength": drawn.strength}
    system.add("train[1]", f"{PARTS}:BrakingLeader", **leader)
    system.add("target", "Schedule", values=drawn.speed)
    tuned = FALLBACK | gains(drawn.law, drawn.speed, reserve) | {"fallback": fallback, "guard": guard}
    brakes = {"limit_force": True, "braking_limit": 400e3 * HARDEST}
    for i in range(2, drawn.trains + 1):
        position = -(i - 1) * gap(drawn.speed, reserve)
        system.add(f"train[{i}]", "PointMassTrain", position=position, speed=drawn.speed, **brakes)
        plans = {"has_plan": True} if drawn.law == "DistributedMpc" and i > 2 else {}
        system.add(f"cruise[{i}]", drawn.law, has_ahead=True, has_behind=i < drawn.trains, **tuned, **plans)
        system.connect("target.value", f"cruise[{i}].target_speed")
        system.connect(f"cruise[{i}].force", f"train[{i}].force")
        for name in ("position", "speed"):
            system.connect(f"train[{i}].{name}", f"cruise[{i}].{name}")
    for i, begin in enumerate(drawn.silences, 1):
        if not perfect:
            system.add(f"channel[{i}]", f"{PARTS}:Channel", begin=begin, end=begin + drawn.outage)
        _connect(system, drawn, i, i + 1, perfect)
        if i > 1:
            _connect(system, drawn, i + 1, i, perfect)
    distance = "train[i-1].position - train[i].position"
    speeds = "train[i].speed, train[i-1].speed"
    system.judged.metrics["margin"] = f"braking_margin({distance}, {speeds}, {BRAKING}, {HARDEST}, 0, {STANDSTILL})"
    system.judged.metrics["gap"] = f"min({distance})"
    if not perfect:
        system.judged.metrics["age"] = "max(radio_ahead[i].age)"
        system.judged.requirements["nothing_forgotten"] = "always not radio_ahead[i].overrun"
    return system


def _connect(system: System, drawn: Draw, sender: int, hearer: int, perfect: bool) -> None:
    """What the hearer's controller knows of the sender: by wire, or by radio."""
    side = "ahead" if sender < hearer else "behind"
    target = f"cruise[{hearer}].{side}"
    if perfect:
        for name in ("position", "speed"):
            system.connect(f"train[{sender}].{name}", f"{target}_{name}")
        return
    losses = {"loss": drawn.loss}
    if drawn.burst > 0.0:
        end = 1.0 / drawn.burst
        losses = {"burst_end": end, "burst_begin": end * drawn.loss / (1.0 - drawn.loss)}
    radio = f"radio_{side}[{hearer}]"
    late = {"refresh": drawn.refresh, "delay": drawn.delay, "jitter": drawn.jitter}
    plans = drawn.law == "DistributedMpc" and 1 < sender < hearer
    build = {"values": 11, "unit": "m/s2"} if plans else {}
    system.add(radio, "RadioLink", build, **late, **losses)
    if plans:
        system.connect(f"cruise[{sender}].plan", f"{radio}.sent_values")
        system.connect(f"{radio}.heard_values", f"{target}_plan")
    system.connect(f"channel[{min(sender, hearer)}].sending", f"{radio}.sending")
    system.connect(f"{radio}.age", f"{target}_age")
    for name in ("position", "speed"):
        system.connect(f"train[{sender}].{name}", f"{radio}.sent_{name}")
        system.connect(f"{radio}.{name}", f"{target}_{name}")


@dataclass(frozen=True)
class Outcome:
    """Smallest braking margin and gap in m and the train they belong to; greatest age of what was heard, s."""

    drawn: Draw
    variant: str
    reserve: float
    margin: float
    train: int
    gap: float
    age: float


def simulate(drawn: Draw, variant: str, reserve: float = RESERVE) -> Outcome:
    """One run of one variant.

    Raises:
        RuntimeError: a message was forgotten under way, so that the radio was not the one that was drawn.
    """
    result = run(system_of(drawn, reserve=reserve, **VARIANTS[variant]))
    if result.failed:
        raise RuntimeError(f"run {drawn.number}: more messages were under way than the radio can hold")
    found = {metric.name: metric.values for metric in result.metrics}
    train = min(found["margin"], key=lambda i: found["margin"][i])
    ages = found.get("age", {0: 0.0}).values()
    shortest = min(found["gap"].values())
    return Outcome(drawn, variant, reserve, found["margin"][train], int(train or 0), shortest, max(ages))


def _task(task: tuple[int, int, str, float]) -> Outcome:
    seed, number, variant, reserve = task
    return simulate(draw(seed, number), variant, reserve)


def campaign(
    seed: int, numbers: Sequence[int], variants: Sequence[str], reserve: float = RESERVE, jobs: int = 1
) -> Iterator[Outcome]:
    """All variants of the runs ``numbers``, in this order."""
    tasks = [(seed, number, variant, reserve) for number in numbers for variant in variants]
    if jobs == 1:
        yield from map(_task, tasks)
        return
    with multiprocessing.get_context("spawn").Pool(jobs) as pool:
        yield from pool.imap(_task, tasks, chunksize=4)


def table(outcomes: Sequence[Outcome], variants: Sequence[str]) -> Iterator[str]:
    """Lines of a Markdown table, one for each variant."""
    yield "| variant | runs | margin < 0 | min m | 1 % m | median m | trains met | worst run |"
    yield "| --- | --- | --- | --- | --- | --- | --- | --- |"
    for variant in variants:
        mine = [x for x in outcomes if x.variant == variant]
        margins = np.array([x.margin for x in mine])
        low, median = np.percentile(margins, [1, 50])
        worst = min(mine, key=lambda x: x.margin)
        met = sum(x.gap <= STANDSTILL - 20.0 for x in mine)
        yield (
            f"| {variant} | {len(mine)} | {(margins < 0.0).sum()} | {margins.min():.1f} | {low:.1f} | {median:.1f} "
            f"| {met} | {worst.drawn.number}, train {worst.train} |"
        )


def told(outcome: Outcome) -> str:
    """A run in words."""
    x = outcome.drawn
    kind = f"in bursts of {x.burst:.1f} messages" if x.burst > 0.0 else "each by itself"
    begins = ", ".join(f"{begin:.2f}" for begin in x.silences)
    return (
        f"{outcome.variant}: run {x.number} of seed {x.seed}, margin {outcome.margin:.2f} m at train {outcome.train}: "
        f"{x.law}, {x.trains} trains at {x.speed:.2f} m/s, reserve {outcome.reserve:g} s; "
        f"braking {x.strength:.3f} m/s2 from {x.brake_time:.2f} s; "
        f"delay {x.delay:.3f} s, jitter {x.jitter:.3f} s, refresh {x.refresh:g} s, "
        f"losses {x.loss:.1%} {kind}, outages of {x.outage:.2f} s from {begins} s; greatest age {outcome.age:.2f} s"
    )


def write(path: Path, outcomes: Sequence[Outcome]) -> None:
    """Every run as a row of a CSV file."""
    with path.open("w", newline="", encoding="utf-8") as file:
        rows: list[dict[str, Any]] = []
        for x in outcomes:
            row = {"variant": x.variant, "reserve": x.reserve, "margin": x.margin, "train": x.train, "gap": x.gap}
            drawn = asdict(x.drawn) | {"silences": " ".join(map(repr, x.drawn.silences))}
            rows.append(row | {"age": x.age} | drawn)
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def _shown(outcomes: Iterator[Outcome], total: int) -> Iterator[Outcome]:
    """The outcomes, with a progress line on the error output."""
    begin = time.perf_counter()
    for count, outcome in enumerate(outcomes, 1):
        seconds = time.perf_counter() - begin
        if count % 10 == 0 or count == total:
            print(f"\r{count} of {total} simulations, {seconds:.0f} s", end="", file=sys.stderr, flush=True)
        yield outcome
    print(file=sys.stderr)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=500, help="how many draws")
    parser.add_argument("--seed", type=int, default=1, help="of the campaign")
    parser.add_argument("--only", type=int, action="append", help="this draw alone; may be given again")
    parser.add_argument("--no-fallback", action="store_true", help="only the variant without the fallback")
    parser.add_argument("--reserve", type=float, action="append", help="time gap in s; may be given again")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--csv", type=Path, help="file for a row for every simulation")
    options = parser.parse_args()
    numbers = options.only or range(options.runs)
    variants = ["no fallback"] if options.no_fallback else list(VARIANTS)
    simulate(draw(options.seed, 0), variants[0])  # the FMUs are built, once
    simulate(draw(options.seed, 1), "no fallback")
    every: list[Outcome] = []
    for reserve in options.reserve or [RESERVE]:
        outcomes = campaign(options.seed, numbers, variants, reserve, options.jobs)
        found = list(_shown(outcomes, len(numbers) * len(variants)))
        every += found
        print(f"\nreserve {reserve:g} s, seed {options.seed}\n")
        print("\n".join(table(found, variants)) + "\n")
        for variant in variants:
            print("- " + told(min((x for x in found if x.variant == variant), key=lambda x: x.margin)), flush=True)
    if options.csv:
        write(options.csv, every)
    return int(any(x.margin < 0.0 for x in every if x.variant in SAFE))


if __name__ == "__main__":
    sys.exit(main())
