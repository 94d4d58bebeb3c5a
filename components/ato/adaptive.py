"""Adaptive control within a trip: a robust gain that is learned anew on each trip."""

from __future__ import annotations

from typing import Any

from ..component import Values
from ..declarations import Memory, Parameter
from ..maths import where
from .port import AtoController


class AdaptiveAto(AtoController):
    """Adaptive control after Song et al. 2011 (Liu & Hou 2020, eqs. 62-63): no model, no memory between trips."""

    source = "Liu & Hou 2020, eqs. 62-63, after Song et al. 2011"
    note = (
        "The source gives no gains; these are ours, and the curves a qualitative counterpart only. In the source's "
        "eqs. 62-63 the symbol printed as a derivative is lambda itself."
    )
    equations = (
        r"$u = -\left( g_0 + \dfrac{\hat h \lambda^2}{D} \right) \delta, \qquad \dot{\hat h} = -g_1 \hat h + g_2"
        r" \dfrac{\lambda^2 \delta^2}{D}$",
        r"$\lambda = 1 + |v| + v^2, \qquad D = \lambda\,|\delta| + \epsilon_1$",
        r"with force $u$, augmented_error $\delta$, speed $v$, robust_gain $\hat h$ (its decay integrated implicitly),"
        r" feedback_gain $g_0$, decay $g_1$, adaptation_gain $g_2$ and smoothing $\epsilon_1$.",
    )
    recommended_step = 0.02

    feedback_gain = Parameter("N.s/m", 1e5, tunable=True, minimum=0.0, description="g_0")
    decay = Parameter("1/s", 1.0, tunable=True, minimum=0.0, description="g_1")
    adaptation_gain = Parameter("1", 20.0, tunable=True, minimum=0.0, description="g_2")
    smoothing = Parameter("m/s", 0.5, tunable=True, minimum=1e-6, description="epsilon_1")

    robust_gain = Memory("1", 0.0, output=True, description="the adapted gain")

    def outputs(self) -> Values:
        errors = self._errors()
        squared, denominator = self._terms(errors.augmented)
        gain = self.feedback_gain + self._adapted(errors.augmented) * squared / denominator
        return self._report(-gain * errors.augmented, errors)

    def update(self) -> Values:
        return {"robust_gain": where(self._waiting(), 0.0, self._adapted(self._errors().augmented))}

    def _terms(self, error: Any) -> tuple[Any, Any]:
        """lambda^2 and D."""
        size = 1.0 + abs(self.speed) + self.speed * self.speed
        return size * size, size * abs(error) + self.smoothing

    def _adapted(self, error: Any) -> Any:
        """The gain that this sample's error leads to; it acts at once."""
        squared, denominator = self._terms(error)
        growth = self.adaptation_gain * squared * error * error / denominator
        return (self.robust_gain + self.sample_time * growth) / (1.0 + self.sample_time * self.decay)
