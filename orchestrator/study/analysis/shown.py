"""A summary as a notebook shows it."""

from __future__ import annotations

import math

from ...markup import MOST_ROWS, escaped, number, table
from .summary import SHARES, Kept, Spread, Summary


def summary_html(summary: Summary, title: str) -> str:
    """Requirements and metrics of a study as tables, and what did not run.

    Args:
        summary: of the study.
        title: of it.
    """
    statuses = ", ".join(f"{count} {status}" for status, count in summary.statuses.items())
    parts = [f"<p><b>{escaped(title)}</b>: {summary.runs} runs{escaped(f' ({statuses})' if statuses else '')}</p>"]
    broken = "".join(f"<li>run {run}: {escaped(error)}</li>" for run, error in summary.broken)
    parts += [f"<ul>{broken}</ul>"] if broken else []
    if summary.requirements:
        heads = ["requirement", "pass", "least margin", "in run", "median"]
        parts.append(table(heads, map(_kept, summary.requirements), "Requirements", most=MOST_ROWS))
    if summary.metrics:
        heads = ["metric", "mean", *(f"{share:.0%}" for share in SHARES), "least", "largest"]
        parts.append(table(heads, map(_spread, summary.metrics), "Metrics", most=MOST_ROWS))
    return "".join(parts)


def _kept(one: Kept) -> list[str]:
    margin = one.margin
    median = margin.quantiles[SHARES.index(0.5)].value
    run = "–" if margin.least_run < 0 else str(margin.least_run)
    return [escaped(one.name), f"{one.passed} of {one.passed + one.failed}", _known(margin.least), run, _known(median)]


def _spread(one: Spread) -> list[str]:
    values = (one.mean.value, *(each.value for each in one.quantiles), one.least, one.largest)
    return [escaped(one.name), *map(_known, values)]


def _known(value: float) -> str:
    return number(None if math.isnan(value) else float(value))
