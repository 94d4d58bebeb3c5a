"""Lines and trains of the TTOBench library (Kouzoupis, Pendharkar & Corman 2023)."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

from .geometry import Curve, Tunnel, sections
from .quantities import Fields, ForeignError

_DOUBLED = ("CH_Stadler_FLIRT_TPF", 0.00093264 * 12960.0)
"""The train whose quadratic resistance is twice what its source gives, and that value in N.s2/m2."""


def is_ttobench(data: Any) -> bool:
    """Whether a JSON file is one of the library's, or meant as one."""
    about = data.get("metadata") if isinstance(data, Mapping) else None
    return isinstance(about, Mapping) and ("library version" in about or "id" in about)


def read(data: Mapping[str, Any]) -> tuple[dict[str, Any], list[str]]:
    """A line or a train of the library in this project's format, and what is to be known of it.

    Raises:
        ForeignError: a value is missing or unusable, or it is neither a line nor a train.
    """
    fields = Fields(data)
    about = _about(fields)
    if "timing points" in data:
        raise ForeignError("'timing points' are a journey's; a line or a train is wanted")
    if not data.keys() & {"stops", "speed limits"}:
        return _train(fields, about), _warnings(data, about)
    return _line(fields, about), []


def _about(fields: Fields) -> dict[str, Any]:
    told = fields.table("metadata")
    authors = f", {told['created by']}" if told.get("created by") else ""
    return {
        "name": str(told.get("id", "")),
        "source": f"{told.get('library version', 'TTOBench')}{authors}",
        "licence": str(told.get("license", "")),
    }


def _line(fields: Fields, about: Mapping[str, Any]) -> dict[str, Any]:
    stops = [row[0] for row in fields.rows("stops", {"position": "place"})]
    if stops[0] != 0.0 or len(stops) < 2:
        raise ForeignError("'stops': the first is at 0 and the last at the end of the line")
    length = stops[-1]
    limits = fields.rows("speed limits", {"position": "place", "velocity": "speed"})
    gradients = _optional(fields, "gradients", {"position": "place", "slope": "gradient"})
    bends = _optional(
        fields, "curvatures", {"position": "place", "radius at start": "radius", "radius at end": "radius"}
    )
    tunnels = _optional(fields, "tunnels", {"position": "place", "length": "length", "cross section": "area"})
    for name, rows in (("speed limits", limits), ("gradients", gradients), ("curvatures", bends)):
        if rows and (rows[0][0] != 0.0 or rows[-1][0] >= length):
            raise ForeignError(f"{name!r}: the first begins at 0, the last before the end of the line, {length:g} m")
    for number, (one, after) in enumerate(itertools.pairwise(tunnels), 1):
        if one[0] + one[1] > after[0]:
            raise ForeignError(
                f"'tunnels' row {number}: it ends at {one[0] + one[1]:g} m, beyond where the next begins"
            )
    ends = [*(row[0] for row in bends[1:]), length]
    curves = [Curve(p, end, a, b) for (p, a, b), end in zip(bends, ends, strict=bool(bends))]
    try:
        made = sections(
            length, [(p, g) for p, g in gradients], curves, [Tunnel(p, p + way, area) for p, way, area in tunnels]
        )
    except ForeignError as error:
        raise ForeignError(f"'tunnels': {error}") from None
    found = {
        **about,
        "altitude": fields.value("altitude", "place", 0.0),
        "stops": [{"position": position} for position in stops],
        "speed_limits": limits,
        "curve_law": "roeckl",
        "sections": made,
    }
    if fields.has("ETCS braking data"):
        etcs = Fields(fields.table("ETCS braking data"), "'ETCS braking data'")
        found["national"] = {
            "M_NVAVADH": etcs.value("M_NVAVADH", "number"),
            "Kt_int": etcs.value("Kt_int", "number"),
        }
        etcs.finish()
    fields.finish()
    return found


def _optional(fields: Fields, name: str, columns: Mapping[str, str]) -> list[list[float]]:
    return fields.rows(name, columns) if fields.has(name) else []


def _train(fields: Fields, about: Mapping[str, Any]) -> dict[str, Any]:
    fields.taken |= {"num seats", "num coaches"}
    found = {
        **about,
        "mass": fields.value("mass", "mass"),
        "rotating_mass": fields.value("rho", "share", 0.0),
        "length": fields.value("length", "length", 0.0),
        "max_speed": fields.value("max speed", "speed"),
        "resistance": {
            "a": fields.value("rolling resistance r0", "force"),
            "b": fields.value("rolling resistance r1", "linear resistance"),
            "c": fields.value("rolling resistance r2", "quadratic resistance"),
        },
        "traction": {
            "force": fields.value("max traction force", "force"),
            "power": fields.value("max traction power", "power"),
            "efficiency": fields.value("efficiency traction", "share", 1.0),
        },
        "regenerative_brake": {
            "force": fields.value("max reg braking force", "force"),
            "power": fields.value("max reg braking power", "power"),
            "efficiency": fields.value("efficiency reg brake", "share", 1.0),
        },
        "friction_brake": fields.value("max pn braking force", "force", 0.0),
        "max_acceleration": fields.value("max acceleration", "acceleration", 0.0),
        "max_deceleration": fields.value("max deceleration", "acceleration", 0.0),
    }
    tunnels = _optional(fields, "tunnel resistance", {"cross section": "area", "coefficient": "quadratic resistance"})
    if tunnels:
        found["tunnel_resistance"] = tunnels
    if fields.has("ETCS braking data"):
        found["etcs"] = _etcs(Fields(fields.table("ETCS braking data"), "'ETCS braking data'"))
    fields.finish()
    return found


def _etcs(fields: Fields) -> dict[str, Any]:
    curve = {"velocity": "speed", "deceleration": "acceleration"}
    found = {
        "A_brake_emergency": fields.rows("A_brake_emergency", curve),
        "A_brake_service": fields.rows("A_brake_service", curve),
        "K_dry_rst": fields.value("K_dry_rst", "number"),
        "K_wet_rst": fields.value("K_wet_rst", "number"),
        "T_traction_cut_off": fields.value("T_traction", "time"),
        "T_be": fields.value("T_be", "time"),
        "T_bs": fields.value("T_bs", "time"),
        "speed_uncertainty": fields.value("v_uncertainty", "share"),
    }
    fields.finish()
    return found


def _warnings(data: Mapping[str, Any], about: Mapping[str, Any]) -> list[str]:
    name, doubled = _DOUBLED
    c = Fields(data).value("rolling resistance r2", "quadratic resistance")
    if about["name"] != name or abs(c - doubled) > 1e-3:
        return []
    return [
        f"'rolling resistance r2' of {name} is twice what the library's source gives, 0.00046632 kN/(km/h)^2: write "
        "that in a copy of the file, or take rolling_stock/flirt.json"
    ]
