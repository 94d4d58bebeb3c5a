"""Verdicts: requirements, values known before the run, and both in a few lines."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ...evaluation import BAD, REFERENCE, UNJUDGED_RUN, ComparedValue, Verdict, count_values
from ...times import digits
from .console import say
from .tables import PLAIN, number, prefixed, show_reasons, table, verdict

_SMALLEST_CLAIM = 16


def show_requirements(out: Console, verdicts: Sequence[Verdict]) -> None:
    """One row a requirement: verdict, signed margin, worst time; below, the signals that decided of those not kept."""
    columns = ("requirement", "verdict", "margin", "worst at", "text")
    made = table("Requirements", columns, right=("margin", "worst at"), fold=("requirement", "text"))
    for v in verdicts:
        place = "" if v.time is None else f"{digits(v.time)} s"
        place += "" if v.index is None else f", i = {v.index}"
        margin = "" if v.margin is None else f"{v.margin:.4g}"
        made.add_row(Text(v.name), verdict(v.verdict), margin, place, Text(" ".join(v.text.split())))
    out.print(made)
    show_reasons(out, "because", ((v.name, v.reason) for v in verdicts if v.reason))
    blamed = ((v.name, " and ".join(v.blame)) for v in verdicts if v.verdict == "fail" and v.blame)
    show_reasons(out, "decided by", blamed)
    say(out, "Requirements are judged at every communication point.", "dim")


def show_values(out: Console, title: str, groups: Mapping[str, Sequence[ComparedValue]]) -> None:
    """Measured beside known, in groups with a line above each: where the values stand, or how to see them."""
    rows = [row for group in groups.values() for row in group]
    own = {row.origin == REFERENCE for row in rows}
    known = "known" if len(own) > 1 else "reference" if own == {True} else "published"
    heads = ["claim", known, "measured", "tolerance", "unit", "verdict"]
    lines = [heads, *map(_cells, rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(heads))]
    widths[0] = max(min(widths[0], out.width - sum(widths[1:]) - 2 * len(heads)), _SMALLEST_CLAIM)
    say(out, f"\n{title}", "bold")
    out.print(_value_table(heads, widths, []))
    for head, group in groups.items():
        say(out, head, "dim italic")
        out.print(_value_table(heads, widths, group))
    for word in ("departs", "not judged", *BAD):
        show_reasons(out, word, ((row.metric, row.reason) for row in rows if row.verdict == word and row.reason))


def _value_table(heads: Sequence[str], widths: Sequence[int], rows: Sequence[ComparedValue]) -> Table:
    made = Table(show_header=not rows, **PLAIN)
    for head, width in zip(heads, widths, strict=True):
        numeric = head not in ("claim", "unit", "verdict")
        made.add_column(head, justify="right" if numeric else "left", overflow="fold", width=width)
    for row in rows:
        *texts, word = _cells(row)
        made.add_row(*map(Text, texts), verdict(word))
    return made


def _cells(row: ComparedValue) -> list[str]:
    if row.judges_truth:
        known, measured = (number(math.nan if x is None else x, "", truth=True) for x in (row.value, row.measured))
        tolerance, unit = "", ""
    else:
        scale, unit = prefixed(row.unit, [row.measured, math.nan if row.value is None else row.value])
        known = "in words" if row.value is None else f"{row.value / scale:.8g}"
        measured = "-" if math.isnan(row.measured) else f"{row.measured / scale:.6g}"
        tolerance = "" if row.tolerance is None else f"{row.tolerance / scale:.3g}"
    return [
        f"{row.metric}: {row.claim}" if row.claim else row.metric,
        known,
        measured,
        tolerance,
        unit,
        row.verdict,
    ]


def by_source(rows: Sequence[ComparedValue]) -> dict[str, list[ComparedValue]]:
    """Known values by where they come from and where they stand."""
    groups: dict[str, list[ComparedValue]] = {}
    for row in rows:
        groups.setdefault(f"{row.origin}: {row.where}" if row.where else row.origin, []).append(row)
    return groups


def summary(requirements: Sequence[Verdict], values: Sequence[ComparedValue]) -> list[tuple[str, bool]]:
    """The verdicts, a line for the requirements and one for each origin of known values, and whether it is bad news.

    Where a run cannot be judged at all, as one that was changed, one line says how many values that are, and why.
    """
    lines = []
    if requirements:
        done = f"{sum(v.verdict == 'pass' for v in requirements)} of {len(requirements)} requirements pass"
        lines.append(_counted(done, [(v.name, v.verdict) for v in requirements], ("fail",)))
    if why := not_judged_at_all(values):
        apart = ", ".join(f"{sum(counts.values())} {origin}" for origin, counts in count_values(values).items())
        known = f"{len(values)} known value{'s' * (len(values) != 1)} ({apart})"
        lines.append((f"{known} not judged, because {why}", False))
        return lines
    for origin, counts in count_values(values).items():
        named = [(row.metric, row.verdict) for row in values if row.origin == origin]
        what = f"{origin} values" + (" (our own)" if origin == REFERENCE else "")
        if origin == "misprint":
            lines.append((f"{len(named)} misprint{'s' * (len(named) != 1)}, never judged", False))
            continue
        done = f"{counts['reproduced']} of {len(named)} {what} reproduced"
        lines.append(_counted(done, named, BAD))
    return lines


def in_one_line(values: Sequence[ComparedValue]) -> str:
    """How many values of each origin were reproduced: ``stated 12 of 13 (1 departs), reference 450 of 450``."""
    parts = []
    for origin, counts in count_values(values).items():
        others = ", ".join(f"{count} {word}" for word, count in counts.items() if word != "reproduced")
        parts.append(f"{origin} {counts['reproduced']} of {sum(counts.values())}" + (f" ({others})" if others else ""))
    return "reproduced: " + ", ".join(parts)


def not_judged_at_all(values: Sequence[ComparedValue]) -> str:
    """Why none of the values can be judged; empty where some can."""
    reasons = {row.reason for row in values if row.reason in UNJUDGED_RUN}
    return reasons.pop() if reasons and all(row.verdict == "not judged" for row in values) else ""


def _counted(text: str, rows: Sequence[tuple[str, str]], bad: Sequence[str]) -> tuple[str, bool]:
    for word in bad:
        named = [name for name, found in rows if found == word]
        text += f"; {word}: {', '.join(named)}" if named else ""
    open_ = Counter(word for _, word in rows if word in ("departs", "inconclusive", "not judged"))
    for word, count in open_.items():
        known = f"depart{'s' * (count == 1)} as known"
        text += f"; {count} {known if word == 'departs' else word}"
    return text, any(word in bad for _, word in rows)
