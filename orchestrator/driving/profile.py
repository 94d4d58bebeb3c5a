"""The profile of a driving: a table over place, written as CSV."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .. import world
from ..errors import naming
from .collocation import Solution
from .dynamics import Floats

PROFILE_FILE = "profile.csv"


class Profile(NamedTuple):
    """Columns over place, all in SI units and of one shape, (n,): forces at the wheels are at least 0."""

    position: Floats
    time: Floats
    speed: Floats
    traction_force: Floats
    braking_force: Floats


def profile_of(solution: Solution) -> Profile:
    """A row at each node of the mesh and at each collocation point.

    A force may jump at a node: there it is the mean of the next ones on both sides, within its power.
    """
    forces = {name: _rows(_at_nodes(solution, name), inside) for name, inside in solution.forces.items()}
    return Profile(
        _rows(solution.nodes, solution.places),
        _rows(solution.node_times, solution.times),
        _rows(solution.node_speeds, solution.inside),
        forces["traction"],
        forces["regeneration"] + forces["friction"],
    )


def write_profile(directory: Path, solution: Solution) -> Path:
    """Write `PROFILE_FILE`; a reader gets the same numbers back.

    Args:
        directory: made if it is not there.
        solution: that is written.
    """
    path = directory / PROFILE_FILE
    world.mkdir(directory, parents=True, exist_ok=True)
    with naming(path), world.open(path, "w", encoding="utf-8", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(Profile._fields)
        table.writerows([repr(float(value)) for value in row] for row in zip(*profile_of(solution), strict=True))
    return path


def _rows(at_nodes: Floats, inside: Floats) -> Floats:
    return np.append(np.column_stack([at_nodes[:-1], inside]).ravel(), at_nodes[-1])


def _at_nodes(solution: Solution, name: str) -> Floats:
    inside = solution.forces[name]
    means = np.concatenate([[inside[0, 0]], 0.5 * (inside[:-1, -1] + inside[1:, 0]), [inside[-1, -1]]])
    forces: Floats = np.minimum(means, solution.dynamics.powers[name] / solution.node_speeds)
    return forces
