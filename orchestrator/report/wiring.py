"""The wiring of a run as a drawing: instances in columns, each after those it listens to; late connections dashed."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

from ..markup import escaped
from ..wiring import condensed, generations, graph_of

_WIDTH, _HEIGHT, _ACROSS, _DOWN, _EDGE = 150, 34, 250, 54, 20
_BEND = 45
"""How far a wire within a column swings out."""
_LATE = re.compile(r"^(\S+) receives (\S+) ")
"""How a run says that a connection is late."""
_MOST = 60
"""Instances that are drawn one by one; of more, each group is one box."""


def draw_wiring(record: Mapping[str, Any]) -> str:
    """The instances and their connections as SVG with a text for who cannot see it."""
    names = list(record.get("instances", {}))
    grouped = len(names) > _MOST
    box = {name: name.partition("[")[0] if grouped else name for name in names}
    late = {(_owner(b, box), _owner(a, box)) for said in record.get("late") or () for a, b in _LATE.findall(said)}
    wires: Counter[tuple[str, str]] = Counter()
    delayed: set[tuple[str, str]] = set()
    for connection in record.get("connections", ()):
        ends = [_owner(connection[end], box) for end in ("source", "target")]
        if None in ends or ends[0] == ends[1]:
            continue
        pair = (str(ends[0]), str(ends[1]))
        wires[pair] += 1
        if connection.get("delay") or pair in late:
            delayed.add(pair)
    boxes = list(dict.fromkeys(box.values()))
    places = _places(boxes, list(wires), delayed)
    width = _EDGE * 2 + _WIDTH + _BEND + _ACROSS * max((x for x, _ in places.values()), default=0)
    height = _EDGE * 2 + _HEIGHT + _DOWN * max((y for _, y in places.values()), default=0)
    parts = [_wire(places, pair, count, pair in delayed) for pair, count in wires.items()]
    parts += [_box(places[name], name, sum(b == name for b in box.values()), record) for name in boxes]
    said = f"{len(names)} instances, {sum(wires.values())} connections"
    if record.get("order"):
        said += ", numbered in the order in which they step"
    tip = 'viewBox="0 0 8 8" refX="8" refY="4" markerWidth="7" markerHeight="7" orient="auto"'
    return (
        '<figure class="wide" tabindex="0" role="region" aria-label="Wiring"><svg class="wiring" role="img" '
        f'viewBox="0 0 {width} {height}" width="{width}" height="{height}"><title>{said}</title>'
        f'<defs><marker id="tip" {tip}><path d="M0 0L8 4L0 8z"/></marker></defs>{"".join(parts)}</svg>'
        f"<figcaption>{said}. Dashed: a value that arrives a communication step late.</figcaption></figure>"
    )


def _owner(signal: str, box: Mapping[str, str]) -> str | None:
    return box.get(signal.partition(".")[0])


def _places(
    boxes: Sequence[str], wires: Sequence[tuple[str, str]], delayed: set[tuple[str, str]]
) -> dict[str, tuple[int, int]]:
    """Column and row of each box: a box stands right of all that it listens to in the same step."""
    graph = graph_of((pair for pair in wires if pair not in delayed), boxes)
    column: dict[str, int] = {}
    for depth, generation in enumerate(generations(condensed(graph))):
        for group in generation:
            members = sorted(group, key=boxes.index)
            for k, name in enumerate(members):  # a loop is laid out along its order
                column[name] = depth + k % 2 * (len(members) > 1)
    rows: dict[int, int] = defaultdict(int)
    found = {}
    for name in boxes:
        found[name] = (column[name], rows[column[name]])
        rows[column[name]] += 1
    return found


def _middle(place: tuple[int, int]) -> tuple[float, float]:
    return _EDGE + place[0] * _ACROSS, _EDGE + place[1] * _DOWN + _HEIGHT / 2


def _wire(places: Mapping[str, tuple[int, int]], pair: tuple[str, str], count: int, is_late: bool) -> str:
    (x0, y0), (x1, y1) = (_middle(places[name]) for name in pair)
    ahead = places[pair[1]][0] - places[pair[0]][0]
    # From the right side to the left one, or the other way round for what goes back; within a column by the right.
    x0, x1 = x0 + _WIDTH * (ahead >= 0), x1 + _WIDTH * (ahead <= 0)
    bend = 0.5 * (x1 - x0) if ahead else _BEND
    y0, y1 = (y + 8 * (ahead < 0) for y in (y0, y1))
    path = f"M{x0} {y0}C{x0 + bend} {y0} {x1 - bend * (1 if ahead else -1)} {y1} {x1} {y1}"
    told = f"{pair[0]} to {pair[1]}: {count} connection{'s' if count > 1 else ''}{', late' if is_late else ''}"
    kind = "wire late" if is_late else "wire"
    return f'<path class="{kind}" d="{path}" marker-end="url(#tip)"><title>{escaped(told)}</title></path>'


def _box(place: tuple[int, int], name: str, members: int, record: Mapping[str, Any]) -> str:
    x, y = _EDGE + place[0] * _ACROSS, _EDGE + place[1] * _DOWN
    told = record["instances"].get(name, {}).get("model", f"{members} instances")
    order = record.get("order") or []
    name = f"{order.index(name) + 1}. {name}" if name in order else name
    label, model = (text if len(text) < 22 else text[:20] + "…" for text in (name, str(told)))
    return (
        f'<g><rect x="{x}" y="{y}" width="{_WIDTH}" height="{_HEIGHT}" rx="5"/>'
        f'<text x="{x + _WIDTH / 2}" y="{y + 14}">{escaped(label)}</text>'
        f'<text class="model" x="{x + _WIDTH / 2}" y="{y + 28}">{escaped(model)}</text>'
        f"<title>{escaped(f'{name}: {told}')}</title></g>"
    )
