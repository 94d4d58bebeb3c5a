"""What holds after every case, whatever has failed in it."""

import random
import re

import numpy as np
from railcosim.orchestrator import Results
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.run import recover_rows

_NAMES = {"run.json", "units.json", "results.csv", "metrics.json", "checkpoint.zip", "seen.bin", ".lock"}
_ENDED = {
    "SIGINT": {130},
    "SIGINT twice": {130},
    "SIGTERM": {143, -15},
    "SIGHUP": {129, -1},
    "SIGKILL": {-9},
    "cut off": {-9},
    "SIGSEGV": {3},
    "exit": {3},
}
_UNSEEMLY = ("Traceback", "Exception ignored", "Fatal Python", "error: a file:", "is not a usable FMU", "dtype")
RESUME = ["run", "--resume", "out", "--no-figures", "--quiet"]
_REFUSED = re.compile(r"cannot be resumed|cannot be read|holds no run|can be resumed|has changed|does not fit")


def broken(bench, seed):
    """What a case has broken, a line each, and what was done in it: the faults, where they struck, what was said."""
    variant, plans = bench.draw(seed)
    reference, place = bench.reference(variant), bench.place(variant)
    told, found, kept, command, is_altered = [str(variant)], [], 0, variant.arguments, False
    for plan in plans:
        ended = bench.disturb(place, command, variant.tick, plan)
        told += [f"{plan}\nstruck: {ended.struck or 'nowhere'}exit code {ended.code}\n{ended.said}"]
        is_altered = is_altered or (plan.manner == "status 2" and bool(ended.struck))
        found += [*_end(plan, ended, reference), *_said(plan, ended)]
        found += _rows(place, ended.code, None if is_altered else reference)
        before, kept = kept, _count(place)
        if kept < before and (ended.code < 0 or not kept):  # a run that ends has its rows and no others
            found += [f"of {before} rows {kept} are left"]
        if not (place / "out" / "checkpoint.zip").exists():
            break
        command = RESUME
    damage = _damage(random.Random(f"damage {seed}"), place)
    goes_on = (place / "out" / "checkpoint.zip").exists()
    if goes_on or damage or ended.code not in (0, 1):
        last = bench.run(place, RESUME if goes_on else variant.arguments, 150.0)  # what dead runs left is old then
        told += [f"{'resumed' if goes_on else 'anew'}, damaged: {damage}, exit code {last.code}\n{last.said}"]
        found += [f"afterwards: says {word!r}" for word in _UNSEEMLY if word in last.said]
        if not (last.code == 2 and goes_on and damage and _REFUSED.search(last.said)):
            code, rows = (last.code, None) if is_altered else (reference.code, reference)
            found += [f"afterwards: {what}" for what in _afterwards(place, last, code, rows)]
    return found, "\n".join(told)


def _end(plan, ended, reference):
    """The exit code is as documented."""
    codes = {reference.code}
    if ended.struck:
        codes |= _ENDED.get(plan.manner, {2, 3})
        if plan.process or (plan.kind in ("fmi", "send", "receive") and plan.manner not in _ENDED):
            codes = {reference.code, 3}  # an FMU is the culprit, or what it does not matter any more
        if plan.manner in ("status 1", "short", "late"):
            codes = {reference.code}
        if plan.manner in ("SIGSEGV", "exit", "SIGKILL", "cut off") and not plan.process:
            codes = _ENDED[plan.manner]
    if ended.code not in codes:
        yield f"exit code {ended.code}, not one of {sorted(codes)}"
    if ended.orphans:
        yield "processes are left"


def _said(plan, ended):
    """The culprit is named, and when it was; nothing that is no sentence."""
    yield from (f"says {word!r}" for word in _UNSEEMLY if word in ended.said)
    if ended.code in (2, 3) and "error: " not in ended.said:
        yield "says nothing of what was wrong"
    if plan.kind == "fmi" and plan.manner.startswith("status") and ended.code == 3:
        if not re.search(r"\b(one|two|three)\b", ended.said):
            yield "does not name the instance"
        if "DoStep" in ended.struck and "t = " not in ended.said:
            yield "does not say when"


def _rows(place, code, reference):
    """What was flushed can be read, and is the beginning of the undisturbed run."""
    out = place / "out"
    rows = [path for path in (out / "results.bin", out / "results.csv") if path.exists() and path.stat().st_size]
    try:
        results = Results.load(out)
    except ScenarioError as error:
        if rows and b"\n" in rows[0].read_bytes():
            yield f"what was flushed cannot be read: {error}"
        elif code in (0, 1):
            yield "there are no results"
        return
    if code in (0, 1) and not results.completed:
        yield f"exit code {code} of a run that says that it is not complete"
    if reference is not None:
        whole = code in (0, 1)
        yield from _compared({"time": results.time, **results}, reference, whole)
    if (out / "results.bin").exists():
        recover_rows(out)
        (out / "results.csv").unlink()


def _count(place):
    """How many rows there are."""
    try:
        return len(Results.load(place / "out").time)
    except ScenarioError:
        return 0


def _compared(rows, reference, whole):
    """Whether rows are those of a reference, all of them or the first."""
    count = len(rows["time"])
    if list(rows) != list(reference.rows):
        yield "other columns than the undisturbed run has"
        return
    if whole and count != len(reference.rows["time"]):
        yield f"{count} rows, not {len(reference.rows['time'])}"
    same = reference.rows if _begin_alike(rows, reference.rows, count) else None
    if same is None and count:  # the point at which the run was stopped, recorded or not
        place = np.flatnonzero(reference.every_row["time"] == rows["time"][-1])
        last = {name: column[place] for name, column in reference.every_row.items()}
        is_end = len(place) == 1 and all(_equal(rows[name][-1:], last[name]) for name in rows)
        # An event that fails leaves the row of the step's end as it was before.
        is_end = is_end or np.isclose(reference.events, rows["time"][-1]).any()
        if whole or not is_end or not _begin_alike(rows, reference.rows, count - 1):
            yield "rows differ from those of the undisturbed run"


def _begin_alike(rows, others, count):
    return all(_equal(column[:count], others[name][:count]) for name, column in rows.items())


def _equal(some, others):
    return some.tobytes() == others.tobytes()


def _damage(draw, place):
    """Damage a file now and then, as a disk does; what was done."""
    files = [path for path in sorted((place / "out").glob("[!.]*")) if path.stat().st_size > 1]
    if not files or draw.random() > 0.3:
        return ""
    path = draw.choice(files)
    content, manner = path.read_bytes(), draw.choice(["cut", "garbled", "emptied"])
    at = draw.randrange(len(content))
    other = bytes([content[at] ^ 0x5A])
    path.write_bytes({"cut": content[:at], "garbled": content[:at] + other + content[at + 1 :], "emptied": b""}[manner])
    return f"{path.name} {manner} at {at}"


def _afterwards(place, ended, code, reference):
    """The run was taken up or begun anew, to the bit; and nothing is left of what died."""
    if ended.code != code:
        yield f"exit code {ended.code}, not {code}"
        return
    yield from _rows(place, ended.code, reference)
    left = {path.name for path in (place / "out").iterdir()} - _NAMES
    left |= {path.name for path in (place / "tmp").iterdir()}
    if left:
        yield f"left: {', '.join(sorted(left))}"
    if [path.name for path in (place / "other").iterdir()] != ["results.bin"]:
        yield "a neighbour's directory was touched"
    if ended.orphans:
        yield "processes are left"
