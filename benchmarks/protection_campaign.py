"""Seeded campaign: the train protection against faulty trains, wet rails, noisy sensors and a controller that is stuck.

    python benchmarks/protection_campaign.py --runs 500 --seed 1 --without-protection --table table.md

Each run is one trip of 190 s of the metro train under `Cailc`, with faults drawn from the campaign's seed and the run's
number. With ``--without-protection`` each draw is run a second time with ``intervene = false``. Six promises are
checked in each run, by numbers computed here from what was recorded; docs/protection_campaign.md derives the bound and
lists the 500 runs. The exit code is 1 where a promise is not kept.
"""

from __future__ import annotations

import argparse
import itertools
import math
import os
import sys
import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from protection_trial import CYCLE, SINGLE, Draw, Outcome, trial

Row = tuple[Draw, Outcome, Outcome | None]


def describe(case: Draw) -> str:
    """What is wrong in a run, in short."""
    parts = []
    train, sensor, ato = case.train, case.sensor, case.ato
    if "traction_limit" in train:
        parts.append(f"{train['traction_limit'] / 1e3:.0f}/{train['braking_limit'] / 1e3:.0f} kN")
    if "traction_power" in train:
        parts.append(f"{train['traction_power'] / 1e6:.1f} MW")
    if "adhesion" in train:
        parts.append(f"adhesion {train['adhesion']:.3f}")
    if "load_factor" in train:
        parts.append("+20 %")
    if "slow sampling" in case.faults:
        parts.append(f"{case.step:g} s{'' if ato['check_sampling'] else ' unchecked'}")
    if sensor:
        parts.append(f"noise {sensor['speed_noise']:.3f} m/s, {sensor['position_noise']:.2f} m")
        parts.append(f"delay {sensor['delay']}" if sensor["delay"] else "")
    if "stuck_from" in ato:
        parts.append(f"stuck {ato['stuck_force'] / 1e3:.0f} kN from {ato['stuck_from']:.0f} s")
    parts.append(f"lag {case.lag:.2f} s" if case.lag else "")
    parts.append("force late" if case.late else "")
    parts.append("by place" if case.by_place else "")
    return ", ".join(part for part in parts if part)


def table(rows: Iterable[Row]) -> str:
    """All runs as a markdown table."""
    lines = [
        "| run | seed | wrong | braked at s | peak m/s | bound m/s | barrier | peak without | without |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for case, with_it, without in rows:
        braked = "never" if with_it.braked_at is None else f"{with_it.braked_at:.2f}"
        barrier = "left, said" if with_it.left_barrier else "left unseen" if with_it.left_unseen else "kept"
        other = "| |"
        if without is not None:
            other = f"| {without.peak:.3f} | {'violation' if without.violation else 'kept'} |"
        fails = "".join(f" **{text}**" for text in with_it.broken + (without.broken if without else []))
        lines.append(
            f"| {case.number} | {case.seed} | {describe(case)}{fails} | {braked} | {with_it.peak:.4f} | "
            f"{with_it.bound:.4f} | {barrier} {other}"
        )
    return "\n".join(lines) + "\n"


def _rocking(rows: list[Row]) -> list[str]:
    """How fast braked trains move after they first stood, over what delays the loop, as a markdown table."""
    lines = [
        "| delays of the loop, in all | sensor | runs braked to a stand | moving again above 0.1 m/s | fastest m/s |",
        "| --- | --- | --- | --- | --- |",
    ]
    edges = (0.0, 0.011, 0.1, 0.3, 1.0, math.inf)
    for low, high in itertools.pairwise(edges):
        for noisy in (False, True):
            some = [
                r[1].rocking
                for r in rows
                if low < _delays(r[0]) <= high and bool(r[0].sensor) == noisy and r[1].rocking > 0.0
            ]
            if some:
                fast = sum(speed > 0.1 for speed in some)
                text = f"up to {high:g} s" if high < math.inf else f"more than {low:g} s"
                sensor = "noisy" if noisy else "perfect"
                lines.append(f"| {text} | {sensor} | {len(some)} | {fast} | {max(some):.3f} |")
    return lines


def _delays(case: Draw) -> float:
    """One sample, the sensor's delay, the late force and the lag of the drive, in s."""
    return (1 + case.sensor.get("delay", 0) + case.late) * case.step + case.lag


def summary(rows: list[Row]) -> str:
    """What the runs say, by kind, as a markdown table, and the worst ones."""
    lines = [
        "| kind | runs | braked | over the limit | largest peak m/s | smallest slack m/s | left the barrier, said |"
        " without: over the limit | largest peak without m/s |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for kind in (*SINGLE, "combination", "all"):
        some = [r for r in rows if kind in ("all", CYCLE[r[0].number % len(CYCLE)])]
        if not some:
            continue
        free = [r[2] for r in some if r[2] is not None]
        left = [r[1] for r in some if r[1].left_barrier]
        slack = [r[1].bound - r[1].peak for r in some if r[1].violation]
        cells = [
            kind, len(some), sum(r[1].braked_at is not None for r in some), sum(r[1].violation for r in some),
            f"{max(r[1].peak for r in some):.3f}", f"{min(slack):.4f}" if slack else "", len(left),
            sum(f.violation for f in free) if free else "", f"{max(f.peak for f in free):.3f}" if free else "",
        ]  # fmt: skip
        lines.append("| " + " | ".join(str(cell) for cell in cells) + " |")
    over = [r for r in rows if r[1].violation]
    if over:
        peak, tight = max(over, key=lambda r: r[1].peak), min(over, key=lambda r: r[1].bound - r[1].peak)
        quantiles = np.quantile([r[1].peak / r[1].bound for r in over], [0.05, 0.25, 0.5, 0.75, 0.95, 1.0])
        lines += [
            "",
            "Peak over bound at 5, 25, 50, 75, 95 and 100 %: " + ", ".join(f"{q:.3f}" for q in quantiles) + ".",
            f"Largest peak: run {peak[0].number} (seed {peak[0].seed}), {peak[1].peak:.4f} of {peak[1].bound:.4f} m/s.",
            f"Least slack: run {tight[0].number} (seed {tight[0].seed}), {tight[1].peak:.4f} of "
            f"{tight[1].bound:.4f} m/s.",
        ]
    stronger = [r for r in rows if r[2] is not None and r[1].peak > r[2].peak + 1e-9]
    if stronger:
        worst = max(stronger, key=lambda r: r[1].peak - (r[2].peak if r[2] else 0.0))
        lines.append(
            f"Larger peak with the protection than without: {len(stronger)} runs, most in run {worst[0].number}, "
            f"{worst[1].peak:.4f} to {worst[2].peak if worst[2] else 0.0:.4f} m/s."
        )
    lines += ["", *_rocking(rows), ""]
    broken = [r for r in rows if r[1].broken or (r[2] and r[2].broken)]
    lines += ["", f"Promises not kept: {len(broken)} runs." if broken else "Every promise was kept in every run."]
    for case, with_it, without in broken:
        texts = [*with_it.broken, *(f"without protection: {t}" for t in (without.broken if without else []))]
        lines.append(f"- run {case.number} (seed {case.seed}; {describe(case)}): {'; '.join(texts)}")
    return "\n".join(lines) + "\n"


def campaign(numbers: Iterable[int], seed: int, *, paired: bool, progress: bool = False) -> list[Row]:
    """Run a campaign."""
    rows: list[Row] = []
    numbers, begin = list(numbers), time.perf_counter()
    for number in numbers:
        rows.append(trial(number, seed, paired=paired))
        for outcome in rows[-1][1:]:
            if outcome is not None:
                outcome.digest = None
        if progress:
            broken = sum(bool(r[1].broken or (r[2] and r[2].broken)) for r in rows)
            seconds = time.perf_counter() - begin
            text = f"\r{len(rows)}/{len(numbers)} runs, {broken} with a promise not kept, {seconds:.0f} s"
            print(text, end="", file=sys.stderr, flush=True)
    if progress:
        print(file=sys.stderr)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=500, help="how many")
    parser.add_argument("--seed", type=int, default=1, help="of the campaign")
    parser.add_argument("--only", type=int, action="append", help="number of a single run; may be given again")
    parser.add_argument("--without-protection", action="store_true", help="run each draw with the brakes off, too")
    parser.add_argument("--table", type=Path, help="file for the table of all runs")
    options = parser.parse_args()
    numbers = options.only or range(options.runs)
    rows = campaign(numbers, options.seed, paired=options.without_protection, progress=True)
    if options.table:
        options.table.write_text(table(rows), encoding="utf-8")
    elif len(rows) <= 20:
        print(table(rows))
    print(summary(rows), flush=True)
    broken = any(r[1].broken or (r[2] and r[2].broken) for r in rows)
    os._exit(int(broken))  # pythonfmu 0.7 may crash while C++ is torn down; see the command line's own end


if __name__ == "__main__":
    main()
