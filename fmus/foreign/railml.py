"""Gradients, speeds and curves of a railML 3 infrastructure."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any, NamedTuple

from lxml import etree

from .geometry import Curve, Tunnel, sections
from .quantities import ForeignError, number

_NAMESPACES = ("https://www.railml.org/schemas/3.", "http://www.railml.org/schemas/3.")
_TRANSITIONS = ("clothoid", "cubicParabola", "bloss", "cosinusoid", "sinusoid", "doubleClothoid")


class _Place(NamedTuple):
    begin: float
    end: float


def read(content: bytes) -> tuple[dict[str, Any], list[str]]:
    """A line in this project's format, and what is to be known of it.

    The file describes one line: all locations lie on one net element (``posBegin`` and ``posEnd``), or have
    coordinates of one linear positioning system (``measure``). Its gradients are in per mille, speeds in km/h,
    lengths and radii in m, as the standard has them.

    Raises:
        ForeignError: it is not railML 3, has no infrastructure, or a value is missing or unusable.
    """
    try:
        root = etree.fromstring(content, etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False))
    except etree.XMLSyntaxError as error:
        raise ForeignError(f"it is not XML: {error}") from None
    namespace = etree.QName(root).namespace or ""
    if etree.QName(root).localname != "railML" or not namespace.startswith(_NAMESPACES):
        raise ForeignError(f"its root is <{etree.QName(root).localname}> in {namespace!r}, not <railML> of version 3")
    infrastructure = next(_all(root, "infrastructure"), None)
    if infrastructure is None:
        raise ForeignError("it has no <infrastructure>")
    places = _Places()
    speeds = _in_order([
        (places.of(element), _number(element, "maxSpeed", "speed") / 3.6)
        for element in _all(infrastructure, "speedSection")
    ], "speedSection")  # fmt: skip
    slopes = _in_order([
        (places.of(element), _number(element, "gradient", "gradient") / 1e3)
        for element in _all(infrastructure, "gradientCurve")
    ], "gradientCurve")  # fmt: skip
    bends = _in_order([
        (places.of(element), element) for element in _all(infrastructure, "horizontalCurve")
    ], "horizontalCurve")  # fmt: skip
    tunnels = _in_order([
        (places.of(element), 0.0)
        for element in _all(infrastructure, "underCrossing")
        if element.get("constructionType") == "tunnel"
    ], "underCrossing")  # fmt: skip
    if not speeds and not slopes and not bends:
        raise ForeignError("it has no <speedSection>, <gradientCurve> or <horizontalCurve>")
    begin, end = places.extent()
    made = sections(
        end - begin,
        list(_without_gaps([(place, value) for place, value in slopes], begin)),
        list(_curves(bends, begin)),
        [Tunnel(place.begin - begin, place.end - begin, 0.0) for place, _ in tunnels],
    )
    found: dict[str, Any] = {
        "name": infrastructure.get("id", ""),
        "source": "railML 3",
        "curve_law": "roeckl",
        "stops": [{"position": 0.0}, {"position": end - begin}],
        "sections": made,
    }
    if speeds:
        found["speed_limits"] = _limits(speeds, begin)
    told = [f"positions count from {begin:g} m, where the first element begins"] if begin else []
    return found, told


class _Places:
    """Where the elements are; all on one axis."""

    def __init__(self) -> None:
        self.axes: set[str] = set()
        self.found: list[_Place] = []

    def of(self, element: Any) -> _Place:
        """Begin and end of an element.

        Raises:
            ForeignError: it has none, or they lie on another axis than those before.
        """
        key = _key(element)
        ends, axis = [], ""
        for name, attribute in (("linearCoordinateBegin", "posBegin"), ("linearCoordinateEnd", "posEnd")):
            coordinate = next(_all(element, name), None)
            on = next((e for e in _all(element, "associatedNetElement") if e.get(attribute) is not None), None)
            if coordinate is not None:
                axis = coordinate.get("positioningSystemRef", "")
                ends.append(_number(coordinate, "measure", "place", key))
            elif on is not None:
                axis = on.get("netElementRef", "")
                ends.append(_number(on, attribute, "place", key))
            else:
                raise ForeignError(f"{key}: it has neither <{name} measure> nor <associatedNetElement {attribute}>")
        if not ends[1] > ends[0]:
            raise ForeignError(f"{key}: its end at {ends[1]:g} m does not exceed its begin at {ends[0]:g} m")
        self.axes.add(axis)
        if len(self.axes) > 1:
            raise ForeignError(
                f"{key}: it lies on {axis!r}, others on {', '.join(sorted(repr(a) for a in self.axes - {axis}))}: "
                "one line is read, with coordinates of one positioning system (measure)"
            )
        self.found.append(_Place(*ends))
        return self.found[-1]

    def extent(self) -> _Place:
        """From the first begin to the last end."""
        return _Place(min(place.begin for place in self.found), max(place.end for place in self.found))


def _all(element: Any, name: str) -> Iterator[Any]:
    return element.iter(f"{{*}}{name}")  # type: ignore[no-any-return]


def _key(element: Any) -> str:
    return f"<{etree.QName(element).localname} id={element.get('id', '')!r}>"


def _number(element: Any, attribute: str, quantity: str, key: str = "") -> float:
    key = f"{key or _key(element)}: {attribute!r}"
    text = element.get(attribute)
    if text is None:
        raise ForeignError(f"{key} is missing")
    try:
        value: Any = float(text)
    except ValueError:
        value = text
    return number(value, quantity, key)


def _in_order(elements: list[tuple[_Place, Any]], name: str) -> list[tuple[_Place, Any]]:
    """Sorted by place.

    Raises:
        ForeignError: two of them overlap.
    """
    found = sorted(elements, key=lambda element: element[0])
    for (one, _), (after, _) in itertools.pairwise(found):
        if after.begin < one.end:
            raise ForeignError(f"<{name}>: one ends at {one.end:g} m, beyond the begin of the next, {after.begin:g} m")
    return found


def _without_gaps(values: list[tuple[_Place, float]], begin: float) -> Iterator[tuple[float, float]]:
    """Steps from the begin of the line; level where nothing is said."""
    for (place, value), after in itertools.zip_longest(values, values[1:]):
        yield place.begin - begin, value
        if after is None or after[0].begin > place.end:
            yield place.end - begin, 0.0


def _curves(bends: list[tuple[_Place, Any]], begin: float) -> Iterator[Curve]:
    """Arcs as they are; a transition goes from the radius of the curve before to that of the curve after it."""
    radii = [_radius(element) for _, element in bends]
    for k, (place, _) in enumerate(bends):
        radius = radii[k]
        if radius is None:
            ahead = radii[k - 1] if k and bends[k - 1][0].end == place.begin else 0.0
            after = radii[k + 1] if k + 1 < len(bends) and bends[k + 1][0].begin == place.end else 0.0
            yield Curve(place.begin - begin, place.end - begin, ahead or 0.0, after or 0.0)
        else:
            yield Curve(place.begin - begin, place.end - begin, radius, radius)


def _radius(element: Any) -> float | None:
    """Of an arc in m, 0 of straight track, None of a transition."""
    kind = element.get("curveType", "arc")
    if kind == "straight":
        return 0.0
    if kind in _TRANSITIONS:
        return None
    radius = _number(element, "radius", "radius")
    if radius == 0.0:
        raise ForeignError(f"{_key(element)}: a radius of 0 is no curve; straight track has curveType 'straight'")
    return radius


def _limits(speeds: list[tuple[_Place, float]], begin: float) -> list[list[float]]:
    """Steps of the limit.

    Raises:
        ForeignError: a stretch has none: no limit is not a limit of zero, nor that of the neighbours.
    """
    expected, found = begin, []
    for place, speed in speeds:
        if place.begin > expected + 1e-6:
            raise ForeignError(f"<speedSection>: no limit from {expected:g} m to {place.begin:g} m")
        found.append([place.begin - begin, speed])
        expected = place.end
    return found
