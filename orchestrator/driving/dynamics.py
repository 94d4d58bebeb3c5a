"""What limits a train over place: its own equations, traced by `fmus` as for its FMUs, and its data's envelopes."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from ...components.component import Component
from ...components.declarations import State
from ...fmus.native.trace import expressions, simplification
from ...fmus.variables import scalar_variables
from .case import Case

Floats = NDArray[np.float64]
FORCES = ("traction", "regeneration", "friction")
"""At the wheels, all at least 0."""


class Dynamics:
    """A case as an optimiser meets it.

    Args:
        case: what is asked for.

    Attributes:
        acceleration: a CasADi function from place (m), speed (m/s) and force (N) to m/s2: the train's equations.
        here, law: the same in two, from places to what they mean to the train, shape (k,), and from that, speed and
            force to m/s2: the line's tables are looked up once, not in each derivative that IPOPT asks for.
        forces, powers: the most of each of `FORCES`, N and W. top_speed: m/s. slowest: m/s.
        most_acceleration, most_deceleration: for comfort, m/s2; infinite where there is no limit.
    """

    def __init__(self, case: Case) -> None:
        wish, train = case.wish, case.train
        self.case = case
        self.acceleration, self.here, self.law = _acceleration(case.component)
        brake = train.regeneration if wish.regeneration else train.regeneration._replace(force=0.0)
        share = 1.0 - wish.reserve
        forces = (train.traction.force, brake.force, train.friction_brake)
        powers = (train.traction.power, brake.power, np.inf)
        self.forces = {name: share * force for name, force in zip(FORCES, forces, strict=True)}
        self.powers = {name: share * power for name, power in zip(FORCES, powers, strict=True)}
        self.costs = dict(zip(FORCES, (1.0 / train.traction.efficiency, -brake.efficiency, 0.0), strict=True))
        self.slowest = min(wish.start_speed, wish.end_speed)
        steps = [speed for _, speed in case.line.limits.steps]
        self.top_speed = min(train.max_speed, max(steps))
        most = (
            train.max_acceleration if wish.acceleration is None else wish.acceleration,
            train.max_deceleration if wish.deceleration is None else wish.deceleration,
        )
        self.most_acceleration, self.most_deceleration = (value or np.inf for value in most)

    def limits(self, places: Floats) -> Floats:
        """The speed limit in m/s at each place, with the train's length and its own top speed."""
        line, train = self.case.line, self.case.train
        found = [min(train.max_speed, float(line.speed_limit(float(x), train.length))) for x in places.ravel()]
        return np.array(found).reshape(places.shape)

    def most(self, name: str, places: Floats) -> Floats:
        """The largest force of a kind in N at each place: none of the electric ones in a neutral section."""
        line, length = self.case.line, self.case.train.length
        free = [name == "friction" or not line.is_neutral(float(x), length) for x in places.ravel()]
        return self.forces[name] * np.array(free, dtype=float).reshape(places.shape)

    def breaks(self) -> list[float]:
        """Where limits change, rising, in m: they stand on the mesh."""
        line, length = self.case.line, self.case.train.length
        ends = [*(begin for begin, _ in line.limits.steps), *(x for pair in line.neutral for x in pair)]
        return sorted({x for end in ends for x in (end, end + length)})

    def slopes(self) -> list[float]:
        """Where the line's resistance changes, in m."""
        return sorted({x for at in self.case.line.positions for x in (at, at + self.case.train.length)})


def _acceleration(train: Component) -> tuple[Any, Any, Any]:
    found = expressions(train)
    variables = scalar_variables(train)
    motion = {name: ca.SX.sym(name) for name in ("position", "speed", "force")}
    values: list[Any] = [0.0] * found.layout.values
    for variable in variables:
        present = np.ravel(np.asarray(train.present_values.get(variable.slot.name, 0.0)))
        values[variable.reference] = motion.get(variable.name, float(present[variable.element or 0]))
    at = [name for slot in train.of(State) for name in slot.scalars].index("speed")
    with simplification(True):
        given = [ca.vertcat(*values), ca.DM.zeros(2)]
        rate = ca.substitute([found.derivatives[at]], [found.values, found.clock], given)[0]
        position, speed, force = motion.values()
        law, names, found_here = ca.extract_parametric(rate, position)
        return (
            ca.Function("acceleration", [position, speed, force], [rate]),
            ca.Function("here", [position], [ca.vertcat(*found_here)]),
            ca.Function("law", [ca.vertcat(*names), speed, force], [law]),
        )
