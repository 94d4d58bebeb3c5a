"""Fault-tolerant cooperative cruise: backstepping along the train, a barrier between trains, and the ablation of it."""

from __future__ import annotations

from abc import ABC
from typing import Any

from ..declarations import Parameter
from ..maths import where
from .barrier import push, share, transform, usable
from .consist_port import Ahead, ConsistCruise
from .observers import IntermediateFaultEstimator, StateFaultEstimator

_SOURCE = "Zhang & Chen 2022 (arXiv 2211.02242)"
_COMMAND = (
    r"$u = M\,[\hat p - \hat f / M + \tau\,(J + \dot n)]$ for each carriage, with the jerk command $J$, the"
    r" observer's $\hat p, \hat f, \hat a$ and $n$ the resistance and coupler forces per mass",
    r"Carriages behind another ($f$): $e_1 = x - x_f + l, \quad e_2 = \delta_v + k_1 e_1, \quad"
    r" e_3 = \delta_a + k_1 \delta_v + k_2 e_2 + e_1$,",
    r"$J = J_f - k_1 \delta_a - k_2 (\delta_a + k_1 \delta_v) - \delta_v - k_3 e_3 - e_2, \qquad"
    r" \delta_v = v - v_f, \quad \delta_a = \hat a - \hat a_f$",
)
_BARRIER = (
    r"Head, behind the tail ($f$) of the train ahead: $e = x_f - x - d_s, \quad e_v = v_f - v, \quad z = e_v + \rho e,"
    r" \quad e_a = \hat a_f - \hat a$,",
    r"$\alpha = \hat a_f + \rho e_v + k_z s_z + k_e h g, \quad e_3 = \hat a - \alpha, \quad"
    r" \sigma = k_z \mu_z + k_e h g', \quad m = \rho + \sigma$,",
    r"$J = J_f + \rho e_a + \sigma\,(e_a + \rho e_v) + k_e h' g e_v - (k_a + k_d m^2)\,e_3 + \gamma s_z \mu_z$",
    r"with $s(y) = \dfrac{a b y}{(a + y)(b - y)}, \quad \mu = s', \quad h = s_e \mu_e, \quad g = z / (s_z \mu_z)$ on"
    r" the ranges $(-a, b)$ of $e$ and $z$, both held at clip_fraction of them",
)


class BarrierCruise(ConsistCruise, ABC):
    """Heads hold distance and speed difference inside their ranges by a barrier-transformed law (eqs. 34-37)."""

    k_z = Parameter("1/s", 0.25, tunable=True, minimum=1e-6, description="gain on the transformed combined error")
    k_e = Parameter("1/s2", 1e-6, tunable=True, minimum=0.0, description="gain on the transformed distance error")
    k_a = Parameter("1/s", 1.2, tunable=True, minimum=1e-6, description="gain on the acceleration error")
    gamma = Parameter(
        "1/s2", 0.01, tunable=True, minimum=1e-9, description="weight that cancels the coupling of z and acceleration"
    )
    k_d = Parameter("s", 0.02, tunable=True, minimum=1e-9, description="nonlinear damping against estimation errors")
    clip_fraction = Parameter(
        "1",
        0.9,
        tunable=True,
        minimum=0.01,
        maximum=0.999,
        description="safe action: fraction of the ranges at which errors are held before they are transformed",
    )

    def _head_jerk(self, ahead: Ahead, own: Ahead) -> Any:
        e, z = self._errors()
        z_range = usable(self._combined_range())
        te = transform(e, usable(self._distance_range()), self.clip_fraction)
        tz = transform(z, z_range, self.clip_fraction)
        h, h_slope = push(te)
        g, g_slope = share(tz, z_range)
        mu_z = where(tz.clipped, 0.0, tz.mu)
        e_v = ahead.speed - own.speed
        e_a = ahead.acceleration - own.acceleration
        virtual = ahead.acceleration + self.rho * e_v + self.k_z * tz.s + self.k_e * h * g
        e3 = own.acceleration - virtual
        sigma = self.k_z * mu_z + self.k_e * h * g_slope
        m = self.rho + sigma
        virtual_rate = ahead.jerk + self.rho * e_a + sigma * (e_a + self.rho * e_v) + self.k_e * h_slope * g * e_v
        return virtual_rate - (self.k_a + self.k_d * m * m) * e3 + self.gamma * tz.s * mu_z


class FaultTolerantCruise(StateFaultEstimator, BarrierCruise):
    """Fault-tolerant cooperative cruise under state constraints (reconstructed after Zhang & Chen 2022).

    For a train of carriages. Reconstructed: every formula is re-derived so that the source's statements hold. A
    state-fault observer estimates each actuator's force and fault; each carriage follows the one in front by
    backstepping; the head keeps e = distance - d_s and z = e_v + rho e in range through a barrier. The command is
    u = M [p^ - (q^0 + q^1) + tau (J + dn/dt)], which makes the jerk the commanded J and cancels the estimated fault.

    Safe action: e and z are held at ``clip_fraction`` of their ranges before they are transformed, and the derivatives
    there are taken as zero: beyond, the head pushes back with a constant demand, and nothing becomes infinite.
    ``barrier_violated`` says that e or z is outside its range itself. ``late_action`` belongs to exchanges in which
    commands act one step late.
    """

    source = f"{_SOURCE}, eqs. 5-6, 13-14, 29-37"
    equations = (*_COMMAND, *_BARRIER, "The observer is that of StateFaultObserver.")
    note = "Reconstructed: formulas, gains and numbers are re-derived to meet the source's statements, not transcribed."


class FaultTolerantCruiseIntermediate(IntermediateFaultEstimator, BarrierCruise):
    """The fault-tolerant cruise with the intermediate estimator for an observer (reconstructed): the baseline.

    Reconstructed and re-derived like `FaultTolerantCruise`, observer after Zhu et al. 2015. It finds constant
    faults; periodic ones leave a residual.
    """

    source = f"{_SOURCE}; observer: Zhu, Yang, Wang, Wang, IEEE TAC 61(9)"
    equations = (*_COMMAND, *_BARRIER, "The observer is that of IntermediateEstimator.")
    note = "Reconstructed: formulas and gains are re-derived; pole placement replaces the source's matrix inequality."


class BacksteppingCruise(StateFaultEstimator, ConsistCruise):
    """The fault-tolerant cruise without its barrier (reconstructed): an ablation, plain backstepping for all.

    Reconstructed and re-derived like `FaultTolerantCruise`. It does not keep the speed difference in its range:
    ``barrier_violated`` only reports.
    """

    source = f"{_SOURCE}, eqs. 29-33 for all carriages"
    equations = (
        *_COMMAND,
        r"Head: the same behind the tail of the train ahead, with $l$ replaced by service_distance $d_s$.",
        "The observer is that of StateFaultObserver.",
    )
    note = "Reconstructed: formulas and gains are re-derived; made to show what the barrier is for."

    def _head_jerk(self, ahead: Ahead, own: Ahead) -> Any:
        return self._follow(ahead, own, self.service_distance)
