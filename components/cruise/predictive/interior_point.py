"""A primal-dual interior point method whose Newton steps are solved stage by stage: the same work at every sample."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...maths import maximum, repeat, total
from .problem import ACCELERATION, GAP, ROWS, SPEED, Problem

_FIRMNESS = 1e6
"""Twice what a violation costs by its scaled square: where no solution keeps everything there is one all the same."""
_CENTRING = 0.15
"""By how much each step brings the mean complementarity down."""
_INTERIOR = 0.99
"""How far towards the nearest bound a step may go."""


def solved(problem: Problem, jerks: Any, steps: int) -> Any:
    """The jerks that minimise a problem's cost.

    Args:
        problem: with data for each stage.
        jerks: to begin with, shape (stages,).
        steps: how many Newton steps are taken.
    """
    excess = problem.excess(problem.motion(jerks), jerks)
    slacks = [maximum(-each, 0.1) for each in excess.ravel().tolist()]
    start = [*jerks.tolist(), *[1.0 / slack for slack in slacks], *slacks]
    return repeat(_newton, steps, start, problem.flat())[: len(jerks)]


def _newton(values: Any, given: Any) -> Any:
    """One step: jerks, then multipliers and slacks of the inequalities, each of shape (ROWS, stages)."""
    problem = Problem.of(given)
    table = values.reshape(2 * ROWS + 1, -1)
    jerks, multipliers, slacks = table[0], table[1 : ROWS + 1], table[ROWS + 1 :]
    p, v, a = motion = problem.motion(jerks)
    excess = problem.excess(motion, jerks)
    barrier = _CENTRING / multipliers.size * total(multipliers * slacks)
    weights = 1.0 / (slacks / multipliers + 1.0 / _FIRMNESS)
    pushes = weights * (excess - multipliers / _FIRMNESS + barrier / multipliers)
    y, h = multipliers + pushes, weights
    steep = (problem.reaction + v / problem.braking) / GAP
    limit, headway, slope = problem.jerk_limit, problem.headway, problem.slope
    gap = problem.gap_weight * (problem.wanted - p - headway * v)
    gradient = (
        y[0] / GAP - gap,
        steep * y[0]
        + (y[2] - y[1]) / SPEED
        + slope / ACCELERATION * y[5]
        - headway * gap
        - problem.follow_weight * (problem.ahead_speed - v)
        - problem.speed_weight * (problem.target_speed - v),
        problem.acceleration_weight * a + (y[4] + y[5] - y[3]) / ACCELERATION,
        problem.jerk_weight * jerks + (y[6] - y[7]) / limit,
    )
    curvature = (
        problem.gap_weight + h[0] / GAP**2,
        problem.gap_weight * headway + h[0] * steep / GAP,
        problem.gap_weight * headway**2
        + problem.follow_weight
        + problem.speed_weight
        + h[0] * steep * steep
        + multipliers[0] / (GAP * problem.braking)
        + (h[1] + h[2]) / SPEED**2
        + (slope / ACCELERATION) ** 2 * h[5],
        slope / ACCELERATION**2 * h[5],
        problem.acceleration_weight + (h[3] + h[4] + h[5]) / ACCELERATION**2,
        problem.jerk_weight + (h[6] + h[7]) / limit**2,
    )
    dp, dv, da, dj = _direction(gradient, curvature, problem.interval)
    moved = np.stack(
        [
            dp / GAP + steep * dv,
            -dv / SPEED,
            dv / SPEED,
            -da / ACCELERATION,
            da / ACCELERATION,
            (da + slope * dv) / ACCELERATION,
            dj / limit,
            -dj / limit,
        ]
    )
    change = weights * moved + pushes
    shift = barrier / multipliers - slacks - slacks / multipliers * change
    nearest: Any = _INTERIOR
    for towards in [*(-change / multipliers).ravel().tolist(), *(-shift / slacks).ravel().tolist()]:
        nearest = maximum(nearest, towards)
    length = _INTERIOR / nearest
    return [
        *(jerks + length * dj),
        *(multipliers + length * change).flat,
        *(slacks + length * shift).flat,
    ]


def _direction(gradient: Any, curvature: Any, interval: Any) -> Any:
    """Changes of position, speed, acceleration and jerk that minimise the quadratic model: a Riccati recursion.

    Args:
        gradient: in these four, of each stage, shape (stages,) each.
        curvature: pp, pv, vv, va, aa, and that in the jerk.
        interval: s.
    """
    t = interval
    bp, bv, ba = t * t * t / 6.0, 0.5 * t * t, t
    half = 0.5 * t * t
    pp = pv = pa = vv = va = aa = qp = qv = qa = 0.0
    gains = []
    columns = [column.tolist() for column in (*gradient, *curvature)]
    for gp, gv, ga, gj, hpp, hpv, hvv, hva, haa, hjj in reversed(list(zip(*columns, strict=True))):
        pp, pv, vv, va, aa = pp + hpp, pv + hpv, vv + hvv, va + hva, aa + haa
        qp, qv, qa = qp + gp, qv + gv, qa + ga
        # the columns of P B, and B'PA
        bpp, bpv, bpa = pp * bp + pv * bv + pa * ba, pv * bp + vv * bv + va * ba, pa * bp + va * bv + aa * ba
        kp, kv, ka = bpp, bpp * t + bpv, bpp * half + bpv * t + bpa
        inverse = 1.0 / (hjj + bp * bpp + bv * bpv + ba * bpa)
        push = (gj + bp * qp + bv * qv + ba * qa) * inverse
        gains.append((kp * inverse, kv * inverse, ka * inverse, push))
        # A'PA - (B'PA)' (B'PA) / (R + B'PB), A = [[1, t, t^2/2], [0, 1, t], [0, 0, 1]]
        xv, xa = pp * t + pv, pp * half + pv * t + pa
        yv, ya = pv * t + vv, pv * half + vv * t + va
        za = pa * half + va * t + aa
        nvv, nva, naa = xv * t + yv, xa * t + ya, xa * half + ya * t + za
        pp, pv, pa = pp - kp * kp * inverse, xv - kp * kv * inverse, xa - kp * ka * inverse
        vv, va, aa = nvv - kv * kv * inverse, nva - kv * ka * inverse, naa - ka * ka * inverse
        qp, qv, qa = qp - kp * push, qp * t + qv - kv * push, qp * half + qv * t + qa - ka * push
    dp = dv = da = 0.0
    rows = []
    for gp, gv, ga, push in reversed(gains):
        dj = -(gp * dp + gv * dv + ga * da + push)
        dp, dv, da = dp + t * dv + half * da + bp * dj, dv + t * da + bv * dj, da + ba * dj
        rows.append((dp, dv, da, dj))
    return np.array(rows).T
