"""The page of runs: verdicts, trains, signals, wiring, provenance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ..markup import escaped, number
from . import tables
from .content import Columns, Content, read_content, signals_of, told_of
from .document import head, write_document
from .live import Live
from .panels import panels
from .wiring import draw_wiring

_PARTS = {"verdicts": "Verdicts", "trains": "Trains", "signals": "Signals", "wiring": "Wiring", "made": "Provenance"}


def write_runs(directories: Sequence[Path], path: Path, names: Sequence[str] = (), live: Live | None = None) -> Path:
    """Write the page of one run, or of several that are seen together.

    Args:
        directories: of the runs.
        path: of the file.
        names: what each is called; scenario and preset, or else the directory, by default.
        live: the models of the one run, if they are in its page.

    Raises:
        ScenarioError: there is no run that can be read.
        RailcosimError: the library that draws is not installed, or the file cannot be written.
    """
    columns = Columns(live=live is not None)
    contents = [read_content(directory, columns) for directory in directories]
    names = list(names) or _names(contents)
    data: dict[str, Any] = {
        "runs": [told_of(content, name, columns) for content, name in zip(contents, names, strict=True)],
        "signals": signals_of(contents),
        "panels": panels(contents, names, columns),
    }
    scripts = ["trains.js", "report.js"]
    if live is not None:
        data["live"] = live.data
        data["panels"].sort(key=lambda panel: not any("track" in line for line in panel["lines"]))  # what follows first
        scripts.insert(1, "live.js")
    body = _body(contents, names, columns, live)
    return write_document(path, contents[0].title, body, data, columns, scripts=scripts)


def _body(contents: Sequence[Content], names: Sequence[str], columns: Columns, live: Live | None) -> Iterator[str]:
    lines = [
        f'<span class="{"holds" if content.record.get("status") == "completed" else "broken"}">'
        f"{escaped(content.record.get('status', ''))}</span> {escaped(name)}"
        for content, name in zip(contents, names, strict=True)
    ]
    parts = _PARTS if live is None else {"live": "Live", **_PARTS}
    yield head(contents[0].title, lines, parts)
    yield "<main>"
    yield _verdicts(contents, names)
    yield "" if live is None else live.section
    yield '<section id="trains" hidden><h2>Trains</h2></section>'
    yield '<section id="signals"><h2>Signals</h2><noscript><p>The curves need JavaScript.</p></noscript></section>'
    yield _wirings(contents, names)
    yield _provenance(contents, names, columns.loss)
    yield "</main>"


def _names(contents: Sequence[Content]) -> list[str]:
    """What tells the runs apart: scenario and preset if that does, else their directories."""
    names = [" ".join(filter(None, (c.record.get("scenario"), c.record.get("preset")))) for c in contents]
    return names if len(set(names)) == len(names) else [str(content.directory) for content in contents]


def _verdicts(contents: Sequence[Content], names: Sequence[str]) -> str:
    parts = ['<section id="verdicts"><h2>Verdicts</h2>']
    parts += [
        tables.findings(content, name if len(contents) > 1 else "")
        for content, name in zip(contents, names, strict=True)
    ]
    parts += [tables.requirements(contents, names)]
    parts += [tables.folded("Metrics", tables.metrics(contents, names), is_open=len(contents) > 1)]
    parts += [tables.folded("Known values", tables.published(contents, names))]
    parts += [tables.folded("Events, faults, outages", tables.happenings(contents, names)), "</section>"]
    return "".join(parts)


def _wirings(contents: Sequence[Content], names: Sequence[str]) -> str:
    drawn: dict[str, list[str]] = {}
    for content, name in zip(contents, names, strict=True):
        drawn.setdefault(draw_wiring(content.record), []).append(name)
    several = len(contents) > 1
    parts = [f"{f'<h3>{escaped(chr(44).join(of))}</h3>' if several else ''}{svg}" for svg, of in drawn.items()]
    return f'<section id="wiring"><h2>Wiring</h2>{"".join(parts)}</section>'


def _provenance(contents: Sequence[Content], names: Sequence[str], loss: float) -> str:
    parts = []
    for content, name in zip(contents, names, strict=True):
        parts += [f"<h3>{escaped(name)}</h3>" if len(contents) > 1 else "", tables.provenance(content)]
    lost = (
        f"<p>Curves are drawn in single precision, at most {number(loss)} of their range off; all digits are in "
        "results.csv of the run.</p>"
    )
    return f'<section id="made"><h2>Provenance</h2>{"".join(parts)}{lost}</section>'
