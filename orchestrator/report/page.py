"""The page: one file with everything in it, and a policy that lets it ask the network for nothing."""

from __future__ import annotations

import html
import importlib.resources
import importlib.util
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .. import world
from ..errors import RailcosimError
from . import tables
from .content import Columns, Content, gather
from .wiring import draw_wiring

REPORT_FILE = "report.html"
_REMEDY = "install the extra: pip install 'railcosim[report]'"
_SCRIPTS = ("bokeh.min.js", "bokeh-api.min.js")
_NETWORK = (("https://cdn.jsdelivr.net/", ""), ("https://maps.googleapis.com/", ""))
"""Where the library would load more from; a page has it all, and shows no mathematics or maps."""


def write_report(directories: Sequence[Path], output: Path | None = None) -> Path:
    """Write a page.

    Args:
        directories: of the runs it shows.
        output: the file; in the first of the directories by default.

    Returns:
        The file.

    Raises:
        ScenarioError: there is no run that can be read.
        RailcosimError: the library that draws is not installed, or the file cannot be written.
    """
    scripts = _library()
    columns = Columns()
    contents = [gather(directory, columns) for directory in directories]
    path = output if output is not None else directories[0] / REPORT_FILE
    part = path.with_name(path.name + ".part")
    try:
        world.write_text(part, _page(contents, columns, scripts), encoding="utf-8")
        world.replace(part, path)
    except OSError as error:
        world.unlink(part, missing_ok=True)
        raise RailcosimError(f"{path} cannot be written: {error.strerror or error}") from error
    return path


def _library() -> list[str]:
    """The charting library's scripts, out of its package, which need not be imported for that."""
    found = importlib.util.find_spec("bokeh")
    if found is None or found.origin is None:
        raise RailcosimError(f"a report is drawn by Bokeh, which is not installed; {_REMEDY}")
    folder = Path(found.origin).parent / "server" / "static" / "js"
    scripts = []
    for name in _SCRIPTS:
        text = world.read_text(folder / name, encoding="utf-8")
        for literal, inert in _NETWORK:
            text = text.replace(literal, inert)
        scripts.append(text)
    return scripts


def _page(contents: Sequence[Content], columns: Columns, scripts: Sequence[str]) -> str:
    own = importlib.resources.files(__package__) / "resources"
    style, script = ((own / name).read_text(encoding="utf-8") for name in ("report.css", "report.js"))
    title = contents[0].shown["title"]
    data = {"runs": [content.shown for content in contents], "columns": columns.told}
    parts = [
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">',
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src 'unsafe-inline'; "
        "style-src 'unsafe-inline'; img-src data: blob:; font-src data:\">",
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{html.escape(title)}</title><style>{style}</style></head><body>",
        _head(contents),
        "<main>",
        *(_run(content, k, len(contents) > 1) for k, content in enumerate(contents)),
        "</main>",
        f'<script type="application/json" id="data">{_inert(json.dumps(_finite(data), allow_nan=False))}</script>',
        *(f'<script type="text/plain" id="column-{k}">{column.text}</script>' for k, column in enumerate(columns.packed)),
        *(f"<script>{_inert_script(text)}</script>" for text in (*scripts, script)),
        "</body></html>\n",
    ]
    return "".join(parts)


def _head(contents: Sequence[Content]) -> str:
    record = contents[0].record
    status = str(record.get("status", ""))
    names = [("verdicts", "Verdicts"), ("trains", "Trains"), ("signals", "Signals"), ("wiring", "Wiring"), ("made", "Provenance")]
    links = "".join(f'<a href="#{place}">{name}</a>' for place, name in names)
    title = tables.escaped(contents[0].shown["title"])
    preset = f", preset {record['preset']}" if record.get("preset") else ""
    told = tables.escaped(f"{record.get('scenario')}{preset}")
    return (
        '<a class="skip" href="#verdicts">Skip to the content</a>'
        f'<header><h1>{title}</h1><p><span class="{"holds" if status == "completed" else "broken"}">{tables.escaped(status)}</span> '
        f'{told}</p><nav aria-label="Parts">{links}</nav></header>'
    )


def _run(content: Content, k: int, several: bool) -> str:
    name = tables.escaped(content.shown["name"])
    known = tables.published(content)
    folded = f"<details{'' if len(known) < 20000 else ''}><summary>Known values</summary>{known}</details>" if known else ""
    measured = tables.metrics(content)
    return "".join(
        [
            f'<h2 class="run">{name}</h2>' if several else "",
            f'<section id="verdicts"><h2>Verdicts</h2>{tables.findings(content)}{tables.requirements(content, k)}',
            f"<details><summary>Metrics</summary>{measured}</details>" if measured else "",
            folded,
            "</section>",
            f'<section id="trains" hidden><h2>Trains</h2><div class="trains" data-run="{k}"></div></section>',
            f'<section id="signals"><h2>Signals</h2><div class="signals" data-run="{k}"></div>',
            "<noscript><p>The curves need JavaScript.</p></noscript></section>",
            f'<section id="wiring"><h2>Wiring</h2>{draw_wiring(content.record)}</section>',
            f'<section id="made"><h2>Provenance</h2>{tables.provenance(content, tables.command_of(content.record))}</section>',
        ]
    )


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
