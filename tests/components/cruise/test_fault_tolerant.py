"""The fault-tolerant controllers: the specified first command, exact jerk, derivatives of virtual controls, dV/dt."""

import math

import numpy as np
import pytest
from railcosim.components import (
    BacksteppingCruise,
    Consist,
    FaultTolerantCruise,
    FaultTolerantCruiseIntermediate,
    ReferenceProfile,
    Simulation,
)

SPEEDS = [(49.6, 49.8, 49.5), (49.2, 49.0, 49.3), (49.5, 49.3, 49.6)]
POSITIONS = [(9985.0, 9959.8, 9934.9), (6654.9, 6630.1, 6604.9), (3504.9, 3479.7, 3454.9)]
A_E, B_E, A_Z, B_Z, RHO = 640.0, 500.0, 3.0, 3.04, 0.014
K_Z, K_E, K_A, GAMMA, K_D = 0.25, 1e-6, 1.2, 0.01, 0.02


class Dual:
    """A number with its rate of change: forward automatic differentiation, independent of the formulas under test."""

    def __init__(self, value, rate=0.0):
        self.value, self.rate = value, rate

    def __add__(self, other):
        other = dual(other)
        return Dual(self.value + other.value, self.rate + other.rate)

    def __mul__(self, other):
        other = dual(other)
        return Dual(self.value * other.value, self.rate * other.value + self.value * other.rate)

    def __truediv__(self, other):
        other = dual(other)
        quotient = self.value / other.value
        return Dual(quotient, (self.rate - quotient * other.rate) / other.value)

    def __neg__(self):
        return self * -1.0

    def __sub__(self, other):
        return self + -dual(other)

    def __rsub__(self, other):
        return dual(other) - self

    __radd__, __rmul__ = __add__, __mul__


def dual(x):
    return x if isinstance(x, Dual) else Dual(x)


def s_of(y, a, b):
    return a * b * y / ((a + y) * (b - y))


def mu_of(y, a, b):
    q = (a + y) * (b - y)
    return a * b * (a * b + y * y) / (q * q)


def resistance(v):
    return 0.01176 + 0.00077616 * v + 1.6e-5 * v * v


def head(e, e_v, a, front=(0.0, 0.0), component=FaultTolerantCruise, **values):
    """A train of one carriage with exact estimates: ``front`` is (acceleration, jerk) of the train ahead."""
    v = 60.0
    controller = component(
        carriages=1,
        position=[0.0],
        speed=[v],
        ahead_position=3200.0 + e,
        ahead_speed=v + e_v,
        ahead_acceleration=front[0],
        ahead_jerk=front[1],
        observed_force=[a + resistance(v)],
        **values,
    )
    return controller.outputs()


def states(count, share=0.89):
    """Random e, e_v, a, a_f, J_f with e and z inside a share of their ranges."""
    rng = np.random.default_rng(5)
    for _ in range(count):
        e = rng.uniform(-share * A_E, share * B_E)
        z = rng.uniform(-share * A_Z, share * B_Z)
        yield e, z - RHO * e, rng.uniform(-2.0, 2.0), rng.uniform(-1.0, 1.0), rng.uniform(-0.5, 0.5)


def test_the_first_command():
    """u(0) of the specification, the whole controller in one evaluation; three trains, front to back, 1e-6 N."""
    expected = [
        (22361.117683, -3118.617357, 31557.423603),
        (44815.090692, 78295.132931, 35221.907972),
        (39865.126110, 7757.814750, 30272.020190),
    ]
    leader = ReferenceProfile(start_position=10e3).outputs()
    ahead = [leader["virtual_position"], leader["speed"], leader["acceleration"], leader["jerk"]]
    for position, speed, force, z in zip(POSITIONS, SPEEDS, expected, (0.61, 1.42, -1.60), strict=True):
        names = ("ahead_position", "ahead_speed", "ahead_acceleration", "ahead_jerk")
        inputs = dict(zip(names, ahead, strict=True))
        simulation = Simulation(FaultTolerantCruise(position=position, speed=speed, **inputs))
        simulation.initialize()
        assert simulation.get("force") == pytest.approx(force, abs=1e-6)
        assert simulation.get("combined_error") == pytest.approx(z, abs=1e-9)
        ahead = [position[2], speed[2], simulation.get("tail_acceleration"), simulation.get("tail_jerk")]


@pytest.mark.parametrize("component", [FaultTolerantCruise, BacksteppingCruise, FaultTolerantCruiseIntermediate])
@pytest.mark.parametrize("carriages", [1, 2, 5])
def test_the_acceleration_changes_at_the_commanded_jerk(component, carriages):
    """With exact estimates da/dt = J: da/dt of the train from its own rates, a quadratic form, so to rounding."""
    rng = np.random.default_rng(carriages)
    mass, lag = rng.uniform(6e4, 9e4, carriages), 0.4
    x = -25.0 * np.arange(carriages) + rng.uniform(-0.2, 0.2, carriages)
    v, force, fault = (
        rng.uniform(50.0, 51.0, carriages),
        rng.uniform(-5e4, 5e4, carriages),
        rng.uniform(-2e4, 2e4, carriages),
    )
    known = {"carriages": carriages, "mass": mass}
    if component is FaultTolerantCruiseIntermediate:
        # f/M = s + mu/tau p, with mu = tau^2 8 / l2, l2 = 12 - l1/tau, l1 = 6 - 1/tau
        ratio = lag * 8.0 / (12.0 - (6.0 - 1.0 / lag) / lag)
        estimate = {"observed_force": force / mass, "intermediate": (fault - ratio * force) / mass}
    else:
        part = rng.uniform(-1.0, 1.0, carriages)
        estimate = {"observed_force": force / mass, "observed_constant": fault / mass - part, "observed_sine": part}
    ahead = {"ahead_position": x[0] + 3230.0, "ahead_speed": 50.4, "ahead_acceleration": 0.2, "ahead_jerk": 0.05}
    found = component(**known, position=x, speed=v, **ahead, **estimate).outputs()

    def acceleration(position, speed, actuator_force):
        return np.array(
            Consist(**known, position=position, speed=speed, actuator_force=actuator_force).outputs()["acceleration"]
        )

    rates = Consist(**known, position=x, speed=v, actuator_force=force, force=found["force"], fault=fault).derivatives()
    moved = [
        acceleration(
            *(q + h * np.array(rates[n]) for n, q in (("position", x), ("speed", v), ("actuator_force", force)))
        )
        for h in (0.01, -0.01)
    ]
    assert ((moved[0] - moved[1]) / 0.02)[-1] == pytest.approx(found["tail_jerk"], abs=1e-9)
    assert found["acceleration_estimate"] == pytest.approx(acceleration(x, v, force), abs=1e-12)
    assert found["fault_estimate"] == pytest.approx(fault, abs=1e-7)


def test_the_jerk_of_a_head_against_automatic_differentiation():
    """The rate of the virtual control alpha comes from dual numbers on its definition; 500 points, 1e-11."""
    for e, e_v, a, a_f, j_f in states(500):
        e_t, e_v_t, a_f_t = Dual(e, e_v), Dual(e_v, a_f - a), Dual(a_f, j_f)
        z_t = e_v_t + RHO * e_t
        h = s_of(e_t, A_E, B_E) * mu_of(e_t, A_E, B_E)
        g = (A_Z + z_t) * (B_Z - z_t)
        g = g * g * g / ((A_Z * B_Z) ** 2 * (A_Z * B_Z + z_t * z_t))
        alpha = a_f_t + RHO * e_v_t + K_Z * s_of(z_t, A_Z, B_Z) + K_E * h * g
        along_e_v = Dual(e_v, 1.0)
        z_e = along_e_v + RHO * e
        q = (A_Z + z_e) * (B_Z - z_e)
        m = RHO * along_e_v + K_Z * s_of(z_e, A_Z, B_Z)
        m = m + K_E * h.value * (q * q * q / ((A_Z * B_Z) ** 2 * (A_Z * B_Z + z_e * z_e)))
        z = z_t.value
        expected = alpha.rate - (K_A + K_D * m.rate**2) * (a - alpha.value)
        expected += GAMMA * s_of(z, A_Z, B_Z) * mu_of(z, A_Z, B_Z)
        found = head(e, e_v, a, (a_f, j_f))["tail_jerk"]
        assert found == pytest.approx(expected, rel=1e-11, abs=1e-11)


def test_the_barrier_function_falls():
    """V = k_e s_e^2/2 + s_z^2/2 + e3^2/(2 gamma): dV/dt <= 0, exact estimates, 500 points in 0.89 of the ranges."""
    for e, e_v, a, a_f, j_f in states(500):
        jerk = head(e, e_v, a, (a_f, j_f))["tail_jerk"]
        e_t, e_v_t, a_t, a_f_t = Dual(e, e_v), Dual(e_v, a_f - a), Dual(a, jerk), Dual(a_f, j_f)
        z_t = e_v_t + RHO * e_t
        s_e, s_z = s_of(e_t, A_E, B_E), s_of(z_t, A_Z, B_Z)
        g = z_t / (s_z * mu_of(z_t, A_Z, B_Z)) if abs(z_t.value) > 1e-9 else Dual(1.0)
        e3 = a_t - (a_f_t + RHO * e_v_t + K_Z * s_z + K_E * s_e * mu_of(e_t, A_E, B_E) * g)
        energy = 0.5 * K_E * s_e * s_e + 0.5 * s_z * s_z + (0.5 / GAMMA) * e3 * e3
        assert energy.rate <= 1e-9 * max(1.0, energy.value)


def test_backstepping_falls_as_proven():
    """V = (e1^2 + e2^2 + e3^2)/2 has dV/dt = -k1 e1^2 - k2 e2^2 - k3 e3^2 exactly."""
    rng = np.random.default_rng(3)
    k1, k2, k3 = 0.6, 0.8, 1.2
    for _ in range(500):
        e1, dv, da, a_f, j_f = rng.uniform(-1.0, 1.0, 5)
        # BacksteppingCruise's head follows at d_s like any other carriage at l.
        jerk = head(-e1, -dv, a_f + da, (a_f, j_f), component=BacksteppingCruise)["tail_jerk"]
        x1, x2, x3 = Dual(e1, dv), Dual(dv, da), Dual(da, jerk - j_f)
        e2 = x2 + k1 * x1
        e3 = x3 + k1 * x2 + k2 * e2 + x1
        energy = 0.5 * (x1 * x1 + e2 * e2 + e3 * e3)
        expected = -k1 * e1**2 - k2 * e2.value**2 - k3 * e3.value**2
        assert energy.rate == pytest.approx(expected, abs=1e-11)


def test_beyond_the_clip_the_demand_is_constant():
    """z at 0.9, at 0.95 and far outside: the part of alpha that pushes back, k_z s_z(0.9), is 3.6 m/s2 and stays."""
    edge = 0.9 * B_Z
    push, g = K_Z * s_of(edge, A_Z, B_Z), edge / (s_of(edge, A_Z, B_Z) * mu_of(edge, A_Z, B_Z))
    assert push == pytest.approx(3.6, abs=0.05)
    # mu_z = g' = 0 there: J = k_e h' g e_v - (k_a + k_d rho^2) e3 with e = 0, h'(0) = 1, a = a_f = 0.
    for z in (0.95 * B_Z, 3.82, 50.0):
        expected = K_E * g * z + (K_A + K_D * RHO**2) * (RHO * z + push)
        assert head(0.0, z, 0.0)["tail_jerk"] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("e", "z", "violated"),
    [
        (0.0, 0.0, False),
        (499.0, 0.0, False),
        (501.0, 0.0, True),
        (-641.0, 0.0, True),
        (0.0, 3.05, True),
        (0.0, -3.0, True),
    ],
)
def test_the_flag_says_that_a_range_is_left(e, z, violated):
    found = head(e, z - RHO * e, 0.0)
    assert found["barrier_violated"] == violated
    assert all(math.isfinite(x) for x in found["force"])


@pytest.mark.parametrize("fraction", [0.01, 0.5, 0.9, 0.999])
@pytest.mark.parametrize("e", [-1e6, -640.0, 0.0, 500.0, 1e6])
@pytest.mark.parametrize("e_v", [-1e3, -10.0, 0.0, 12.0, 1e3])
def test_it_stays_finite_wherever_it_is(fraction, e, e_v):
    assert math.isfinite(head(e, e_v, 0.0, clip_fraction=fraction)["tail_jerk"])


def test_without_estimation_error_the_fault_is_cancelled():
    """The command with a fault is that without one, less the fault."""
    without, with_fault = (
        head(10.0, 0.1, 0.0, observed_constant=[c], observed_sine=[s])["force"][0]
        for c, s in ((0.0, 0.0), (0.15, -0.04))
    )
    assert without - with_fault == pytest.approx(80e3 * 0.11, abs=1e-8)
