"""What stands between a controller and the wheels: drive and brakes with their limits, delays and energies."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..component import Component, Values
from ..declarations import Data, Input, Memory, Output, Parameter, Size, State
from ..environment.curve import GRAVITY
from ..maths import clip, floor, maximum, minimum, piecewise_constant, where
from .line_train import EXAMPLE
from .rolling_stock import TRAIN, TRAIN_DESCRIPTION, Effort

_SLOWEST = 0.1
"""m/s: below this speed the power limit is that of this speed."""
_PUT = 1e-3
"""m: so little further than it can have come is rounding."""
DRY, WET, LEAVES = 1.0, 0.6, 0.2
"""Shares of the dry rail's adhesion; that of Curtius and Kniffler is the dry one's."""


class _Forces(NamedTuple):
    """At the wheels in N, magnitudes: traction, regenerative brake, friction brake."""

    traction: Any
    regeneration: Any
    friction: Any


class Drive(Component):
    """Drive and brakes of a train, between a controller's force and the train's: any of either.

    The force asked for passes a dead time. Traction and the regenerative brake keep their envelopes of force and power
    over speed, fade out towards the standstill as asked for, build up as a lag of first order, no faster than the jerk
    limit, and are off in a neutral section. What the regenerative brake does not give of the braking asked for, now,
    is the friction brake's, which builds up slower and has a limit of its own. Adhesion bounds what the wheels pass on:
    Curtius and Kniffler's formula, times a share by place (dry 1, wet 0.6, leaves 0.2), on the driven share of the
    weight for traction and on all of it for braking; what is beyond is cut, the friction brake's part first.

    Energies count the force that was held over each step times the way made in it, which is exact for a train that
    holds its input. A position that stands still while the train drives is one that is not told: the way made since it
    was counts once it is told again, with the force held then. A train that is elsewhere than it can have come to since
    its position last changed has been put there: that way counts nothing.
    """

    source = "envelopes and efficiencies: the train's data; adhesion: Curtius & Kniffler 1944; shares of it chosen"
    note = "Build-up times, fade-out and the shares of adhesion on wet rails and leaves are typical magnitudes."
    equations = (
        r"$T^* = \min(f^+, F_\mathrm{t}, P_\mathrm{t}/v), \qquad R^* = \min(f^-, F_\mathrm{r}, P_\mathrm{r}/v)\,\min(v"
        r" / v_\mathrm{f}, 1)$",
        r"$\dot E = \mathrm{clip}((T^* - R^* - E) / \tau_\mathrm{e}, \pm j m), \qquad \dot B = \mathrm{clip}((\min(f^-"
        r" - E^-, F_\mathrm{b}) - B) / \tau_\mathrm{b}, \pm j m)$; without a time constant and a jerk limit at once",
        r"$F = E - B$ within $\pm \mu\,m g$, traction within the driven share of it,"
        r" $\mu = \kappa \left( 0.161 + \dfrac{7.5}{44 + 3.6 v} \right)$",
        r"with force $F$, demanded_force $f$ after the dead time, its positive and negative parts $f^\pm$, electric"
        r" force $E$, friction_force $B$, the train's limits $F, P$, fade_speed $v_\mathrm{f}$, time constants $\tau$,"
        r" jerk limit $j$, mass $m$, share of adhesion $\kappa$ at the position.",
    )

    train = Data(EXAMPLE, convert=TRAIN.record, description=TRAIN_DESCRIPTION)
    points = Size(1, description="number of places from which adhesion is given")
    delays = Size(4, description="samples that the dead time may last")

    demanded_force = Input("N", description="force the controller asks for, traction positive")
    position = Input("m", description="position of the train")
    speed = Input("m/s", description="its speed")
    neutral = Input("1", False, optional=True, description="whether the train is in a neutral section")

    max_step = Parameter("s", 0.01, minimum=0.0, description="longest integration step inside a communication step")
    electric_time = Parameter("s", 0.2, minimum=0.0, description="time constant of traction and regenerative brake")
    friction_time = Parameter("s", 0.8, minimum=0.0, description="time constant of the friction brake")
    dead_time = Parameter("s", 0.0, minimum=0.0, description="delay of the force asked for, in whole samples")
    jerk = Parameter("m/s3", 0.0, minimum=0.0, description="fastest change of each force over the mass; 0 is no limit")
    fade_speed = Parameter("m/s", 0.0, minimum=0.0, description="below this speed the regenerative brake fades out")
    use_regeneration = Parameter("1", True, tunable=True, description="whether the regenerative brake works")
    limit_adhesion = Parameter("1", True, tunable=True, description="whether adhesion limits the forces")
    driven_share = Parameter("1", 1.0, minimum=0.0, maximum=1.0, description="share of the weight on driven axles")
    positions = Parameter("m", 0.0, shape=(points,), rising=True, description="places from which adhesion holds")
    adhesion = Parameter(
        "1",
        DRY,
        shape=(points,),
        minimum=0.0,
        tunable=True,
        description="share of the dry rail's adhesion from each on",
    )

    electric_state = State("N", 0.0, description="lagged force of traction (+) and regenerative brake (-)")
    friction_state = State("N", 0.0, description="lagged force of the friction brake")
    asked = Memory("N", 0.0, shape=(delays,), description="forces asked for at the last samples, latest first")
    sample = Memory("s", 0.0, description="length of the last sample")
    last_position = Memory("m", 0.0, description="position at the last sample")
    last_speed = Memory("m/s", 0.0, description="speed at the last sample")
    untold = Memory("m", 0.0, description="furthest it can have come since its position last changed")
    held = Memory("N", 0.0, shape=(3,), description="traction, regeneration and friction held since then")
    drawn_energy = Memory("J", 0.0, output=True, description="energy drawn for traction, losses included")
    recovered_energy = Memory("J", 0.0, output=True, description="energy given back by the regenerative brake")
    friction_energy = Memory("J", 0.0, output=True, description="energy that the friction brake turned into heat")

    force = Output("N", description="force for the train")
    electric_force = Output("N", description="of traction (+) or regenerative brake (-), at the wheels")
    friction_force = Output("N", description="of the friction brake, positive")
    sliding = Output("1", bool, description="whether adhesion cuts the force")

    def initial(self) -> Values:
        return {"last_position": self.position, "last_speed": self.speed}

    def derivatives(self) -> Values:
        rate = where(self.jerk > 0.0, self.jerk * self.train.mass, 1e12)
        electric, friction = self._targets()
        shortest = maximum(self.max_step, 1e-3)  # a faster lag could not be integrated
        lags = maximum(self.electric_time, shortest), maximum(self.friction_time, shortest)
        return {
            "electric_state": clip((electric - self.electric_state) / lags[0], -rate, rate),
            "friction_state": clip((friction - self.friction_state) / lags[1], -rate, rate),
        }

    def outputs(self) -> Values:
        whole = self._built_up()
        passed = self._passed(whole)
        electric = passed.traction - passed.regeneration
        cut = (whole.traction - passed.traction) + (whole.regeneration - passed.regeneration)
        return {
            "force": electric - passed.friction,
            "electric_force": electric,
            "friction_force": passed.friction,
            "sliding": cut + (whole.friction - passed.friction) > 0.0,
        }

    def update(self) -> Values:
        made = abs(self.position - self.last_position)
        # Between two samples a speed stays between what it was and what it is, but for what grades do within one.
        furthest = self.untold + 2.0 * self.sample * maximum(abs(self.speed), abs(self.last_speed))
        way = where(made <= furthest + _PUT, made, 0.0)
        traction, regeneration, friction = self.held
        return {
            "asked": [self.demanded_force, *self.asked[:-1]],
            "sample": self.step,
            "last_position": self.position,
            "last_speed": self.speed,
            "untold": where(made > 0.0, 0.0, furthest),
            "held": list(self._passed(self._built_up())),
            "drawn_energy": self.drawn_energy + traction * way / self.train.traction.efficiency,
            "recovered_energy": self.recovered_energy + regeneration * way * self.train.regeneration.efficiency,
            "friction_energy": self.friction_energy + friction * way,
        }

    def _asked(self) -> Any:
        """The force asked for, a dead time ago."""
        late = minimum(floor(self.dead_time / maximum(self.sample, 1e-6) + 0.5), 1.0 * self.delays)
        return piecewise_constant(late, [float(k) for k in range(self.delays + 1)], [self.demanded_force, *self.asked])

    def _targets(self) -> tuple[Any, Any]:
        """Electric force, and that of the friction brake, before they build up."""
        asked, electric = self._asked(), self._electric()
        missing = maximum(-asked, 0.0) - maximum(-electric, 0.0)
        return self._electric_target(asked), clip(missing, 0.0, self.train.friction_brake)

    def _electric_target(self, asked: Any) -> Any:
        traction = minimum(maximum(asked, 0.0), self._most(self.train.traction))
        fading = where(self.fade_speed > 0.0, minimum(abs(self.speed) / maximum(self.fade_speed, 1e-3), 1.0), 1.0)
        brake = minimum(maximum(-asked, 0.0), self._most(self.train.regeneration)) * fading
        return where(self.neutral, 0.0, traction - where(self.use_regeneration, brake, 0.0))

    def _most(self, effort: Effort) -> Any:
        """The envelope of force and power at the present speed in N."""
        return minimum(effort.force, effort.power / maximum(abs(self.speed), _SLOWEST))

    def _electric(self) -> Any:
        """The electric force as it is: built up, and within the envelope at the present speed."""
        at_once = self.electric_time + self.jerk <= 0.0
        built_up = where(at_once, self._electric_target(self._asked()), self.electric_state)
        inside = clip(built_up, -self._most(self.train.regeneration), self._most(self.train.traction))
        return where(self.neutral, 0.0, inside)

    def _built_up(self) -> _Forces:
        electric = self._electric()
        at_once = self.friction_time + self.jerk <= 0.0
        friction = where(at_once, self._targets()[1], maximum(self.friction_state, 0.0))
        return _Forces(maximum(electric, 0.0), maximum(-electric, 0.0), friction)

    def _passed(self, forces: _Forces) -> _Forces:
        """What the wheels pass on."""
        share = piecewise_constant(self.position, self.positions, self.adhesion)
        limit = share * (0.161 + 7.5 / (44.0 + 3.6 * abs(self.speed))) * self.train.mass * GRAVITY
        limit = where(self.limit_adhesion, limit, 1e12)
        regeneration = minimum(forces.regeneration, limit)
        return _Forces(
            minimum(forces.traction, self.driven_share * limit),
            regeneration,
            minimum(forces.friction, limit - regeneration),
        )
