"""A line: what slopes and curves add to a train's resistance, how fast it may be run on, and where to stop."""

from __future__ import annotations

from typing import Any

from ..component import Component, Values
from ..declarations import Data, Input, Output, Parameter, Size
from ..maths import piecewise_constant
from ..trains.rolling_stock import TRAIN, TRAIN_DESCRIPTION
from .curve import GRAVITY
from .track import DESCRIPTION, read_line

FLAT = [{"position": 0.0, "gradient": 0.0}]
"""A line that adds nothing."""
POINT = {"mass": 400e3}
"""A train without length."""


class Line(Component):
    """The resistance of slopes, curves and tunnels for one train, and the line's speed limits, stops, neutral sections.

    Specific resistance g (gradient + curve + tunnel) + resistance; the gradient is rise over run, uphill positive, the
    curve 600/R N/kN or Röckl's, a tunnel of length L adds 0.00013 L N/kN, or of known cross-section what the train's
    data say, which grows with the square of the ``speed``. Of a train with a length it is the mean over that length,
    as of an evenly spread mass: the exact integral, transition curves included. One without is a point. Before the
    first section the line has the first one's resistance. ``gradients`` are added to those of the sections, at the
    train's front.

    ``line_resistance`` is all of it for a train that runs forwards. ``curve_resistance`` is what of it opposes motion,
    whichever way: curve, tunnel and further resistance. A train that is not told takes all for the slope's, and a
    curve may then pull it back at rest.

    ``speed_limit`` is the lowest under any part of the train.
    """

    source = (
        "gradient: weight along the slope; curves: 600/R N/kN, usual in Chinese traction calculation (TB/T 1407), or "
        "Röckl's 650/(R - 55), below 300 m 500/(R - 30)"
    )
    equations = (
        r"$r = \dfrac{1}{l} \int_{x-l}^{x} \left( g\,i(\xi) + r_\mathrm{c}(\xi) \right) \mathrm{d}\xi + g\,\Delta i"
        r" + \bar c_\mathrm{t}\,v^2 / m$, at $l = 0$ the value at $x$, with a section's gradient $i$ and further"
        r" gradient $\Delta i$;",
        r"$r_\mathrm{c} = g \left( 0.6\,/\,R + 1.3 \cdot 10^{-7} L \right) + r_0$ (or Röckl's law of $R$), with radius"
        r" $R$, in a transition curve $1/R$ linear in $\xi$; tunnel $L$ in m, further resistance $r_0$,",
        r"train's length $l$ and mass $m$, mean further drag in tunnels $\bar c_\mathrm{t}$; line_resistance $r$, and"
        r" curve_resistance the mean of $r_\mathrm{c}$ with the tunnel's.",
    )

    line = Data(FLAT, convert=read_line, description=DESCRIPTION)
    train = Data(POINT, convert=TRAIN.record, description=TRAIN_DESCRIPTION)

    points = Size(1, description="number of further gradients")

    position = Input("m", description="position of the train's front")
    speed = Input("m/s", optional=True, description="its speed, for tunnels of known cross-section")
    positions = Parameter("m", 0.0, shape=(points,), rising=True, description="begins of further gradients, rising")
    gradients = Parameter(
        "1", 0.0, shape=(points,), description="rise over run added from each on, to vary without building anew"
    )
    factor = Parameter("1", 1.0, description="factor on the whole resistance, to know it wrongly on purpose")

    line_resistance = Output("N/kg", description="resistance of slope, curve and tunnel per mass")
    curve_resistance = Output("N/kg", description="part of it that opposes motion either way: curve and tunnel")
    speed_limit = Output("m/s", description="lowest limit under the train; 1000 where there is none")
    next_stop = Output("m", description="where the next stop is that the front has not passed; 1e9 after the last")
    neutral = Output("1", bool, description="whether any part of the train is in a neutral section")

    def outputs(self) -> Values:
        resistance, opposing = self._resistances()
        further = GRAVITY * piecewise_constant(self.position, self.positions, self.gradients)
        return {
            "line_resistance": self.factor * (resistance + further),
            "curve_resistance": self.factor * opposing,
            "speed_limit": self.line.speed_limit(self.position, self.train.length),
            "next_stop": self.line.next_stop(self.position),
            "neutral": self.line.is_neutral(self.position, self.train.length),
        }

    def _resistances(self) -> tuple[Any, Any]:
        line, train = self.line, self.train
        if not train.length:
            point: tuple[Any, Any] = line.resistance(self.position)
            return point
        whole, opposing = line.mean_resistance(self.position, train.length)
        drag = line.mean(train.tunnel_drags(line.areas), self.position, train.length)
        tunnel = drag * self.speed * self.speed / train.mass
        return whole + tunnel, opposing + tunnel
