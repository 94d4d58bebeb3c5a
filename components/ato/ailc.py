"""Adaptive iterative learning control without a barrier."""

from __future__ import annotations

from typing import Any

from ..component import Values
from .learning import LearningAto


class Ailc(LearningAto):
    """Adaptive iterative learning control of a subway train (AILC, Liu & Hou 2020, eqs. 12-13): no bounds, no barrier.

    Outside the mild conditions of the source nothing keeps its error small: `Cailc` watches itself, this one does not.
    """

    source = "Liu & Hou 2020, eqs. 10-13"
    note = "The default learning gain is corrected to (5e5, 0.01, 0.01); the source's (100, 0.01, 0.01) hardly learns."
    equations = (
        r"$\delta = \alpha\,(x - x_\mathrm{r}) + (v - v_\mathrm{r})$",
        r"$q_1 = p_1 - \Gamma_1 \delta, \qquad q_2 = p_2 - \Gamma_2 v\,\delta, \qquad q_3 = p_3 - \Gamma_3 v^2 \delta$",
        r"$u = q_1 + q_2 v + q_3 v^2 + M a_\mathrm{r} - M \alpha\,(v - v_\mathrm{r}) - \beta\,\delta$",
        r"with force $u$, estimate $q$, learned $p$ (the estimate of the trip before at this instant),"
        r" augmented_error $\delta$, position $x$, speed $v$, reference_position $x_\mathrm{r}$, reference_speed"
        r" $v_\mathrm{r}$, reference_acceleration $a_\mathrm{r}$, learning_gain $\Gamma$ and mass $M$.",
    )
    recommended_step = 0.05

    def keep(self) -> Any:
        return self._is_numbered()

    def outputs(self) -> Values:
        errors = self._errors()
        estimate = self._corrected(errors.augmented)
        return self._report(self._law(estimate, errors), errors, estimate)

    def update(self) -> Values:
        return self._record(self._corrected(self._errors().augmented))
