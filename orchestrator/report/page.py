"""The page: one file with everything in it, and a policy that lets it ask the network for nothing."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .. import world
from ..errors import RailcosimError
from ..markup import escaped, number
from . import tables
from .content import Columns, Content, read_content, shown
from .wiring import draw_wiring

REPORT_FILE = "report.html"
_REMEDY = "install the extra: pip install 'railcosim[report]'"
_SCRIPTS = ("bokeh.min.js", "bokeh-api.min.js")
_OWN = Path(__file__).parent / "resources"
_RESOURCES = ("report.css", "page.js", "trains.js", "report.js")
_NETWORK = (("https://cdn.jsdelivr.net/", ""), ("https://maps.googleapis.com/", ""))
"""Where the library would load more from; a page has it all, and shows no mathematics or maps."""


def write_report(directories: Sequence[Path], output: Path | None = None, names: Sequence[str] = ()) -> Path:
    """Write a page.

    Args:
        directories: of the runs it shows.
        output: the file; in the first of the directories by default.
        names: what each is called; scenario and preset, or else the directory, by default.

    Returns:
        The file.

    Raises:
        ScenarioError: there is no run that can be read.
        RailcosimError: the library that draws is not installed, or the file cannot be written.
    """
    scripts = _library()
    columns = Columns()
    contents = [read_content(directory, columns) for directory in directories]
    path = output if output is not None else directories[0] / REPORT_FILE
    part = path.with_name(path.name + ".part")
    try:
        world.write_text(part, _page(contents, list(names) or _names(contents), columns, scripts), encoding="utf-8")
        world.replace(part, path)
    except OSError as error:
        world.unlink(part, missing_ok=True)
        raise RailcosimError(f"{path} cannot be written: {error.strerror or error}") from error
    return path


def check_drawable() -> Path:
    """Where the charting library's scripts are, which need not be imported for a page.

    Raises:
        RailcosimError: it is not installed.
    """
    found = importlib.util.find_spec("bokeh")
    if found is None or found.origin is None:
        raise RailcosimError(f"a report is drawn by Bokeh, which is not installed; {_REMEDY}")
    return Path(found.origin).parent / "server" / "static" / "js"


def _library() -> list[str]:
    """Its scripts, without the addresses where it would load more."""
    folder = check_drawable()
    scripts = []
    for name in _SCRIPTS:
        text = world.read_text(folder / name, encoding="utf-8")
        for literal, inert in _NETWORK:
            text = text.replace(literal, inert)
        scripts.append(text)
    return scripts


def _page(contents: Sequence[Content], names: Sequence[str], columns: Columns, scripts: Sequence[str]) -> str:
    style, *parts = (world.read_text(_OWN / name, encoding="utf-8") for name in _RESOURCES)
    data = _inert(json.dumps(_finite(shown(contents, names, columns)), allow_nan=False))
    return "".join(
        [
            '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">',
            "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'unsafe-inline'; "
            "style-src 'unsafe-inline'; img-src data: blob:; font-src data:\">",
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            f"<title>{escaped(contents[0].title)}</title><style>{style}</style></head><body>",
            _head(contents, names),
            "<main>",
            _verdicts(contents, names),
            '<section id="trains" hidden><h2>Trains</h2></section>',
            '<section id="signals"><h2>Signals</h2><noscript><p>The curves need JavaScript.</p></noscript></section>',
            _wirings(contents, names),
            _provenance(contents, names, columns.loss),
            "</main>",
            f'<script type="application/json" id="data">{data}</script>',
            *(
                f'<script type="text/plain" id="column-{k}">{each.text}</script>'
                for k, each in enumerate(columns.packed)
            ),
            *(f"<script>{_inert_script(text)}</script>" for text in (*scripts, *parts)),
            "</body></html>\n",
        ]
    )


def _names(contents: Sequence[Content]) -> list[str]:
    """What tells the runs apart: scenario and preset if that does, else their directories."""
    names = [" ".join(filter(None, (c.record.get("scenario"), c.record.get("preset")))) for c in contents]
    return names if len(set(names)) == len(names) else [str(content.directory) for content in contents]


def _head(contents: Sequence[Content], names: Sequence[str]) -> str:
    parts = {"verdicts": "Verdicts", "trains": "Trains", "signals": "Signals", "wiring": "Wiring", "made": "Provenance"}
    links = "".join(f'<a href="#{place}">{name}</a>' for place, name in parts.items())
    lines = [
        f'<p><span class="{"holds" if content.record.get("status") == "completed" else "broken"}">'
        f"{escaped(content.record.get('status', ''))}</span> {escaped(name)}</p>"
        for content, name in zip(contents, names, strict=True)
    ]
    return (
        '<a class="skip" href="#verdicts">Skip to the content</a>'
        f"<header><h1>{escaped(contents[0].title)}</h1>{''.join(lines)}"
        f'<nav aria-label="Parts">{links}</nav></header>'
    )


def _verdicts(contents: Sequence[Content], names: Sequence[str]) -> str:
    parts = ['<section id="verdicts"><h2>Verdicts</h2>']
    parts += [
        tables.findings(content, name if len(contents) > 1 else "")
        for content, name in zip(contents, names, strict=True)
    ]
    parts += [tables.requirements(contents, names)]
    parts += [tables.folded("Metrics", tables.metrics(contents, names))]
    parts += [tables.folded("Known values", tables.published(contents, names)), "</section>"]
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
        f"<p>Curves are drawn in single precision, at most {number(loss)} off in their unit; all digits are in "
        "results.csv of the run.</p>"
    )
    return f'<section id="made"><h2>Provenance</h2>{"".join(parts)}{lost}</section>'


def _finite(value: Any) -> Any:
    """What JSON can say."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and value - value != 0.0 else value


def _inert(text: str) -> str:
    """JSON that ends no script element, whatever names it holds."""
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def _inert_script(text: str) -> str:
    """A library's script: the end of an element may stand in its strings."""
    return text.replace("</script", "<\\/script")
