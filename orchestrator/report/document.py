"""A page as a file: everything in it, and a policy that lets it ask the network for nothing."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from .. import world
from ..errors import RailcosimError
from ..markup import escaped
from .content import Columns

_REMEDY = "install the extra: pip install 'railcosim[report]'"
_LIBRARY = ("bokeh.min.js", "bokeh-api.min.js")
_OWN = Path(__file__).parent / "resources"
_NETWORK = (("https://cdn.jsdelivr.net/", ""), ("https://maps.googleapis.com/", ""))
"""Where the library would load more from; a page has it all, and shows no mathematics or maps."""

_ALLOWED = {"live.js": " 'wasm-unsafe-eval'; worker-src blob:"}
"""What scripts may do beyond what all may, as a policy says it: compile models, and simulate in a thread."""


def write_document(
    path: Path, title: str, body: Iterable[str], data: Mapping[str, Any], columns: Columns, *, scripts: Sequence[str]
) -> Path:
    """Write a page.

    Args:
        path: of the file.
        title: of the page, as text.
        body: of it, as markup.
        data: what its scripts are given.
        columns: the signals.
        scripts: its own, by their names in ``resources``, beside those that all pages have.

    Returns:
        The file.

    Raises:
        RailcosimError: the library that draws is not installed, or the file cannot be written.
    """
    part = path.with_name(path.name + ".part")
    text = "".join(_page(title, body, data, columns, scripts))
    try:
        world.write_text(part, text, encoding="utf-8", errors="backslashreplace")
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


def head(title: str, lines: Sequence[str], parts: Mapping[str, str]) -> str:
    """What stands on top of a page.

    Args:
        title: as text.
        lines: below it, as markup.
        parts: the titles of the parts of the page, by their places.
    """
    links = "".join(f'<a href="#{place}">{escaped(name)}</a>' for place, name in parts.items())
    return (
        f'<a class="skip" href="#{next(iter(parts))}">Skip to the content</a>'
        f"<header><h1>{escaped(title)}</h1>{''.join(f'<p>{line}</p>' for line in lines)}"
        f'<nav aria-label="Parts">{links}</nav></header>'
    )


def _page(
    title: str, body: Iterable[str], data: Mapping[str, Any], columns: Columns, scripts: Sequence[str]
) -> Iterable[str]:
    folder = check_drawable()
    yield '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
    more = "".join(_ALLOWED.get(name, "") for name in scripts)
    yield (
        '<meta http-equiv="Content-Security-Policy" content="default-src \'none\'; '
        f"script-src 'unsafe-inline'{more}; style-src 'unsafe-inline'; img-src data: blob:; font-src data:; "
        "base-uri 'none'; form-action 'none'\">"
    )
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield f"<title>{escaped(title)}</title><style>{_own('report.css')}</style></head><body>"
    yield from body
    told = json.dumps(_finite({**data, "columns": columns.told}), allow_nan=False)
    yield f'<script type="application/json" id="data">{_inert(told)}</script>'
    for k, each in enumerate(columns.packed):
        yield f'<script type="text/plain" id="column-{k}">{each.text}</script>'
    for name in _LIBRARY:
        text = world.read_text(folder / name, encoding="utf-8")
        for literal, inert in _NETWORK:
            text = text.replace(literal, inert)
        yield f"<script>{_inert_script(text)}</script>"
    for name in ("page.js", "tables.js", "panels.js", *scripts):
        yield f"<script>{_own(name)}</script>"
    yield "</body></html>\n"


def _own(name: str) -> str:
    return world.read_text(_OWN / name, encoding="utf-8")


def _finite(value: Any) -> Any:
    """What JSON can say."""
    if isinstance(value, Mapping):
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
