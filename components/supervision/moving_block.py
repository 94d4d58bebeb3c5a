"""Moving block and virtual coupling: a movement authority from what is heard of the train ahead."""

from __future__ import annotations

from typing import Any

from ..component import Component, Values
from ..declarations import Input, Output, Parameter
from ..maths import clip, where
from ..tables import FASTEST


class MovingBlock(Component):
    """A movement authority that ends at the safe rear of the train ahead.

    The safe rear is where its rear is at least, by the last message: its front, less its length and what its position
    may be wrong by. Absolute braking distance (moving block) takes the train ahead for a wall at its safe rear.
    ``relative`` (virtual coupling) adds the way that it still runs at least: from the speed it reported, less what that
    may be wrong by, braking with ``ahead_braking``. It has to be the hardest that its brakes, its resistance and the
    gradient give together; a train that stops at an obstacle stops shorter, and is not covered.

    Neither bound moves back with a message's age, and none gets unsafe with it: a train that has braked since it sent
    the message stands where the bound is, and no train runs backwards. ``stale`` tells that one is older than
    ``age_limit``.
    """

    source = "moving block: SUBSET-026 3.6.4 (safe rear end), level 2 with train integrity; relative distance: ours"
    equations = (
        r"$x_\mathrm{SvL} = x_\mathrm{a} - L_\mathrm{a} - e_x + \rho \max(v_\mathrm{a} - e_v, 0)^2 / (2 b_\mathrm{a}),"
        r" \quad x_\mathrm{EoA} = x_\mathrm{SvL} - m$",
        r"with the train ahead's position $x_\mathrm{a}$ and speed $v_\mathrm{a}$ as heard, its length $L_\mathrm{a}$,"
        r" errors $e_x$, $e_v$ of these, $\rho = 1$ where relative is set, else 0, its hardest braking $b_\mathrm{a}$,"
        r" margin $m$; without a train ahead the end of the line.",
    )

    has_ahead = Input("1", False, optional=True, description="whether there is a train ahead")
    ahead_position = Input("m", flag=has_ahead, description="position of its front, as heard")
    ahead_speed = Input("m/s", flag=has_ahead, description="its speed, as heard")
    ahead_age = Input("s", optional=True, description="how old that is")

    relative = Parameter(
        "1", False, tunable=True, description="whether the train ahead's own braking distance is counted on"
    )
    ahead_length = Parameter("m", 100.0, minimum=0.0, description="length of the train ahead")
    position_error = Parameter(
        "m", 15.0, tunable=True, minimum=0.0, description="how far behind its reported front the train ahead may be"
    )
    speed_error = Parameter(
        "m/s", 0.6, tunable=True, minimum=0.0, description="how much slower than it reports the train ahead may be"
    )
    ahead_braking = Parameter(
        "m/s2", 1.5, tunable=True, minimum=1e-3, description="hardest braking of the train ahead, gradient included"
    )
    margin = Parameter("m", 20.0, tunable=True, minimum=0.0, description="from the end of authority to the safe rear")
    end_of_line = Parameter("m", 1e7, tunable=True, description="end of authority without a train ahead")
    age_limit = Parameter("s", 2.0, tunable=True, minimum=0.0, description="age from which a message is stale")

    end_of_authority = Output("m", description="end of authority")
    supervised_location = Output("m", description="supervised location")
    stale = Output("1", bool, description="whether the last message is old")

    def outputs(self) -> Values:
        known = clip(self.ahead_speed - self.speed_error, 0.0, FASTEST)
        run_out = where(self.relative, known * known / (2.0 * self.ahead_braking), 0.0)
        bound: Any = self.ahead_position - self.ahead_length - self.position_error + run_out
        location = where(self.has_ahead, bound, self.end_of_line + self.margin)
        return {
            "end_of_authority": location - self.margin,
            "supervised_location": location,
            "stale": where(self.has_ahead, self.ahead_age > self.age_limit, False),
        }
