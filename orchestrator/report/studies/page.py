"""The page of a study or a search: what came out, a map of its runs, each of them, provenance."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ...markup import escaped, number
from ...study.analysis import SHARES, Estimate, Sensitivity, Summary
from ..content import Columns
from ..document import head, write_document
from ..tables import folded, table
from .table import columns_of, errors_of, first_rows, series_of
from .told import SEARCH_FILE, Told, told_of_search, told_of_study

_PARTS = {"summary": "What came out", "map": "Runs", "run": "One run", "made": "Provenance"}
_MOST_OUTPUTS = 8
_NOTHING = 1e-12
"""What is less is what rounding leaves of a share of none."""


def write_study(directory: Path, path: Path) -> Path:
    """Write the page of a study, or of a search.

    Args:
        directory: that holds it.
        path: of the file.

    Raises:
        ScenarioError: it cannot be read.
        RailcosimError: the library that draws is not installed, or the file cannot be written.
    """
    told = told_of_search(directory) if (directory / SEARCH_FILE).is_file() else told_of_study(directory)
    columns, frame = Columns(), first_rows(told.frame)
    carried = columns_of(frame, told.varied, told.labels, columns)
    data = {
        "runs": [],
        "signals": [],
        "study": {
            "columns": carried,
            "count": len(frame),
            "replay": told.replay,
            "commands": told.commands[: len(frame)],
            "axes": told.axes or _strongest(told),
            "requirement": told.requirement,
            "best": [run for run, _, _ in told.found if run >= 0],
            "errors": errors_of(frame),
            "series": {"signals": [], "runs": {}}
            if told.study is None
            else series_of(told.study, _in_order(told), columns),
        },
    }
    body = _body(told, len(frame), columns)
    return write_document(path, told.title, body, data, columns, scripts=("parallel.js", "study.js"))


def _strongest(told: Told) -> tuple[str, ...]:
    """What a map begins with: the two parameters that matter most; or the only one, and what came out."""
    order = [one.name for made in told.sensitivities[:1] for one in made.influences] or told.varied
    outputs = [name for name in map(str, told.frame) if name.startswith(("margin.", "metric."))]
    return tuple([*order[:2], *outputs, "run"][:2])


def _in_order(told: Told) -> list[int]:
    """The runs, those that fail a requirement first, then those that come nearest to it."""
    frame = told.frame
    margins = [frame[name].to_numpy(float) for name in map(str, frame) if name.startswith("margin.")]
    scaled = [np.argsort(np.argsort(np.nan_to_num(each, nan=np.inf))) for each in margins]
    failing = [(frame[name] == "fail").to_numpy() for name in map(str, frame) if name.startswith("verdict.")]
    rank = np.min(scaled, axis=0) if scaled else np.zeros(len(frame))
    fails = np.any(failing, axis=0) if failing else np.zeros(len(frame), bool)
    return [int(run) for run in frame["run"].to_numpy()[np.lexsort((rank, ~fails))]]


def _body(told: Told, shown: int, columns: Columns) -> Iterator[str]:
    kind = "holds" if told.is_whole else "open"
    yield head(told.title, [f'<span class="{kind}">{escaped(told.state)}</span>'], _PARTS)
    yield '<main><section id="summary"><h2>What came out</h2>'
    if told.summary is not None:
        yield _summary(told.summary)
    if told.found:
        rows = [[_button(run), escaped(said), f"<code>{escaped(command)}</code>"] for run, said, command in told.found]
        yield table(["run", "what", "run it"], rows, "What was found")
    for made in told.sensitivities[:_MOST_OUTPUTS]:
        yield folded(f"What matters for {made.output}", _influences(made))
    yield '</section><section id="map"><h2>Runs</h2>'
    if shown < len(told.frame):
        yield f"<p>The first {shown} of {len(told.frame)} runs are shown; all are in runs.parquet.</p>"
    yield '<noscript><p>The runs need JavaScript.</p></noscript></section><section id="run"><h2>One run</h2></section>'
    facts = "".join(f"<dt>{escaped(name)}</dt><dd>{_fact(value)}</dd>" for name, value in told.facts)
    yield f'<section id="made"><h2>Provenance</h2><dl>{facts}</dl>'
    yield f"<p>Numbers are carried in single precision, at most {number(columns.loss)} of their range off; all digits "
    yield "are in runs.parquet.</p></section></main>"


def _fact(value: str) -> str:
    return f"<code>{escaped(value)}</code>" if "orchestrate " in value else escaped(value)


def _summary(summary: Summary) -> str:
    statuses = ", ".join(f"{count} {status}" for status, count in summary.statuses.items())
    parts = [f"<p>{escaped(statuses)}. {escaped(summary.note)}</p>"]
    items = "".join(f'<li class="broken">{_button(run)} {escaped(error)}</li>' for run, error in summary.broken)
    parts += [f'<ul class="told">{items}</ul>'] if items else []
    rows = [
        [
            escaped(one.name),
            f'<span class="{"broken" if one.failed else "holds"}">{one.passed} of {one.passed + one.failed}</span>',
            _estimate(one.rate, 100.0, " %"),
            _number(one.margin.least),
            _button(one.margin.least_run),
            _number(one.margin.quantiles[SHARES.index(0.5)].value),
            " ".join(map(_button, one.failing)),
        ]
        for one in summary.requirements
    ]
    heads = ["requirement", "pass", "share", "least margin", "in run", "median", "the first that fail"]
    parts += [table(heads, rows, "Requirements")] if rows else []
    shares = [f"{share:.0%}" for share in SHARES]
    spread = [
        [
            escaped(one.name),
            _estimate(one.mean),
            _number(one.sd),
            *map(_estimate, one.quantiles),
            _number(one.least),
            _button(one.least_run),
            _number(one.largest),
            _button(one.largest_run),
        ]
        for one in summary.metrics
    ]
    heads = ["metric", "mean", "sd", *shares, "least", "in run", "largest", "in run"]
    parts += [folded("Metrics", table(heads, spread, "Metrics"))] if spread else []
    return "".join(parts)


def _influences(made: Sensitivity) -> str:
    rows = [
        [escaped(one.name), *map(_estimate, (one.first, one.total, one.correlation, one.regression))]
        for one in made.influences
    ]
    said = f"{made.runs} runs" + (f"; shares by {made.method}" if made.method else "")
    said += "" if math.isnan(made.explained) else f"; ranks explain {made.explained:.0%} of its variance"
    heads = ["parameter", "alone", "with others", "rank correlation", "regression"]
    return table(heads, rows, f"What matters for {made.output}: {said}")


def _estimate(value: Estimate, scale: float = 1.0, unit: str = "") -> str:
    """A value, with its interval in brackets where there is one."""
    if math.isnan(value.value):
        return "–"
    said, low, high = (f"{scale * x:.4g}" if abs(x) > _NOTHING else "0" for x in value)
    return f"{said}{unit}" + f" <small>[{low}, {high}]</small>" * (not math.isnan(value.low))


def _number(value: float) -> str:
    return "–" if math.isnan(value) else number(value)


def _button(run: int) -> str:
    """What shows a run."""
    return "–" if run < 0 else f'<button type="button" data-number="{run}">{run}</button>'
