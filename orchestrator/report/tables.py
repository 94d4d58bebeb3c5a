"""The parts of a page that need no script: verdicts, metrics, published values, provenance."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import islice
from typing import Any

from .. import markup
from ..markup import escaped, number
from .content import Content
from .happenings import bands_of

_VERDICTS = {"pass": "holds", "fail": "broken", "inconclusive": "open"}
_MARKS = {"pass": "✓", "fail": "✗", "inconclusive": "?"}


_LISTED = 500
"""Of what happened, so much is listed."""


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], caption: str) -> str:
    """A table that can be sorted, and moved sideways where it is wider than the page."""
    made = markup.table(heads, rows, caption, "sortable")
    return f'<div class="wide" tabindex="0" role="region" aria-label="{escaped(caption)}">{made}</div>'


def requirements(contents: Sequence[Content], names: Sequence[str]) -> str:
    """Verdict, margin, and where it was decided; a button goes there."""
    rows = []
    for run, content in enumerate(contents):
        for place, verdict in enumerate(content.metrics.get("requirements", ())):
            kind, at = verdict["verdict"], number(verdict["time"])
            button = f'<button type="button" data-run="{run}" data-requirement="{place}">{at} s</button>'
            rows.append(
                [
                    *_of(names, run),
                    f'<span class="{_VERDICTS.get(kind, "open")}">{_MARKS.get(kind, "?")} {escaped(kind)}</span>',
                    escaped(verdict["name"]),
                    number(verdict["margin"]),
                    at if verdict["time"] is None else button,
                    "" if verdict["index"] is None else number(verdict["index"]),
                    f"<code>{escaped(verdict['text'])}</code>{_small(verdict['reason'])}",
                ]
            )
    heads = [*_head_of(names), "verdict", "name", "margin", "decided at", "of", "requirement"]
    return table(heads, rows, "Requirements") if rows else ""


def metrics(contents: Sequence[Content], names: Sequence[str]) -> str:
    """Every metric, one row a value, one column a run."""
    found: dict[tuple[str, str], list[object]] = {}
    told: dict[tuple[str, str], Mapping[str, Any]] = {}
    for run, content in enumerate(contents):
        for name, metric in content.metrics.get("metrics", {}).items():
            for index, value in (metric["values"] or {"": None}).items():
                found.setdefault((name, index), [None] * len(contents))[run] = value
                told.setdefault((name, index), metric)
    rows = [
        [
            escaped(name + (f"[{index}]" if index else "")),
            *map(number, values),
            escaped(told[name, index]["unit"]),
            f"<code>{escaped(' '.join(told[name, index]['expression'].split()))}</code>"
            f"{_small(told[name, index]['problem'])}",
        ]
        for (name, index), values in found.items()
    ]
    values = list(names) if len(names) > 1 else ["value"]
    return table(["metric", *values, "unit", "expression"], rows, "Metrics") if rows else ""


def published(contents: Sequence[Content], names: Sequence[str]) -> str:
    """Known values beside what was measured; what a source printed and what is ours are told apart."""
    rows = [
        [
            *_of(names, run),
            escaped(row["verdict"]),
            escaped(row["metric"]),
            number(row["value"]),
            number(row["measured"]),
            number(row["tolerance"]),
            escaped(row["unit"]),
            escaped(row["origin"]),
            f"{escaped(row['claim'])}{_small(row['where'])}{_small(row['reason'] or row['departs'])}",
        ]
        for run, content in enumerate(contents)
        for row in (*content.metrics.get("published", ()), *content.metrics.get("references", ()))
    ]
    heads = [*_head_of(names), "verdict", "metric", "known", "measured", "tolerance", "unit", "origin", "claim"]
    return table(heads, rows, "Known values") if rows else ""


def happenings(contents: Sequence[Content], names: Sequence[str]) -> str:
    """Events, faults and outages: from when until when."""
    rows = [
        [*_of(names, run), number(band["from"]), number(band["until"]), escaped(band["label"])]
        for run, content in enumerate(contents)
        for band in islice(bands_of(content.record), _LISTED)
    ]
    return table([*_head_of(names), "from [s]", "until [s]", "what"], rows, "Events, faults, outages") if rows else ""


def _of(names: Sequence[str], run: int) -> list[str]:
    """A cell that tells the run, where there are several."""
    return [escaped(names[run])] if len(names) > 1 else []


def _head_of(names: Sequence[str]) -> list[str]:
    return ["run"] if len(names) > 1 else []


def findings(content: Content, name: str) -> str:
    """What ended a run, what no train can do, and what was said of it."""
    said = [str(finding["message"]) for finding in content.record.get("findings", ())]
    said += [str(note) for note in content.record.get("notes", ())]
    error, record = content.record.get("error"), content.record
    items = [f'<li class="broken">{escaped(error)}</li>'] if error else []
    if record.get("status") != "completed":
        reached = number(float(content.results.time[-1]) if content.results.points else None)
        items += [f"<li>The last point that was recorded is at {reached} s of {number(record['stop_time'])} s.</li>"]
    if record.get("status") == "running":
        items += ["<li>It had not ended when this page was made: it went on, or had been killed.</li>"]
    items += [f"<li>{escaped(text)}</li>" for text in said]
    head = f"<h3>{escaped(name)}</h3>" if name else ""
    return f'{head}<ul class="told">{"".join(items)}</ul>' if items else ""


def provenance(content: Content) -> str:
    """What produced the numbers, and how to have them again."""
    record = content.record
    facts: list[tuple[str, str]] = [
        ("run again", command_of(record)),
        ("run", f"<code>{escaped(record.get('run', ''))}</code>"),
        ("algorithm", escaped(f"{record.get('algorithm')}, step {number(record.get('step'))} s")),
        ("time", _time_of(record)),
        ("files", f"<code>{escaped(content.directory)}</code>"),
        ("seed", escaped(record.get("seed"))),
        ("versions", escaped(", ".join(f"{k} {v}" for k, v in record.get("versions", {}).items()))),
        ("Python", escaped(f"{record.get('python')} on {record.get('platform')}")),
    ]
    listed = "".join(f"<dt>{name}</dt><dd>{value}</dd>" for name, value in facts)
    rows = [
        [
            escaped(name),
            escaped(told["model"]),
            escaped(told["kind"]),
            f"<code>{escaped(str(told['digest'])[:16])}</code>",
        ]
        for name, told in record.get("instances", {}).items()
    ]
    models = table(["instance", "model", "kind", "digest (begin)"], rows, "Instances")
    starts = table(
        ["parameter", "value", "unit"],
        [[escaped(k), number(v), escaped(_unit(content, k))] for k, v in content.results.parameters.items()],
        "Parameters and start values",
    )
    return f"<dl>{listed}</dl>{folded('Instances', models)}{folded('Parameters', starts)}"


def _unit(content: Content, name: str) -> str:
    return content.results.units.get(name, "")


def _time_of(record: Mapping[str, Any]) -> str:
    said = f"{number(record.get('start_time'))} to {number(record.get('time_reached'))} s"
    resumed = record.get("resumed")
    return said + (f", gone on from its checkpoint at {number(resumed)} s" if resumed is not None else "")


def folded(title: str, markup: str, *, is_open: bool = False) -> str:
    """What is shown when it is asked for; nothing of nothing."""
    return f"<details{' open' * is_open}><summary>{escaped(title)}</summary>{markup}</details>" if markup else ""


def _small(text: object) -> str:
    return f"<small>{escaped(text)}</small>" if text else ""


def command_of(record: Mapping[str, Any]) -> str:
    """What runs the same again, as markup."""
    if record.get("command"):
        return f"<code>{escaped(record['command'])}</code>"
    return "no command is known: its system was made or changed in Python; what it was stands in run.json"
