"""The document of drive."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...driving import Optimum


@dataclass(frozen=True)
class DriveErrors:
    """How well the optimum is known.

    Attributes:
        feasibility, optimality: the largest residuals of constraints and of optimality conditions, scaled.
        mesh: in m/s, of the speed at an interval's end, beside an integration of the train's equations over it.
        objective: its relative change by the last refinement; null where there was none.
    """

    feasibility: float
    optimality: float
    mesh: float
    objective: float | None


@dataclass(frozen=True)
class DriveDocument:
    """The best driving of a case.

    Attributes:
        minimize: what is least. energy_kwh: drawn less given back.
        mesh: how many intervals each mesh had, the last one's being the profile's.
    """

    case: str
    title: str
    minimize: str
    energy_kwh: float
    time_s: float
    errors: DriveErrors
    mesh: list[int]
    iterations: int
    profile: str


def drive_document(optimum: Optimum, profile: Path) -> DriveDocument:
    """The document of an optimum.

    Args:
        optimum: that was found.
        profile: its file.
    """
    case, found = optimum.case, optimum.solution
    return DriveDocument(
        case.name,
        case.title,
        case.wish.minimize,
        found.energy / 3.6e6,
        found.time,
        DriveErrors(found.feasibility, found.optimality, optimum.mesh_error, optimum.change),
        optimum.meshes,
        optimum.iterations,
        str(profile),
    )
