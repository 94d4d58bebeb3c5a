"""The five cars of *chasing cars*, a problem of the ARCH competition on falsification: the first driven, others follow.

After Hu, Lygeros and Sastry, "Towards a theory of stochastic hybrid systems", HSCC 2000. Equations, thresholds and
starts are those of ``cars.mdl``, the Simulink model of the competition, as it stands in the repository
ERATOMMSD/falstar (commit a67f1eb, falstar/resource/simulink). Positions fall while a car goes ahead.
"""

from typing import Any

from railcosim.components import Component, Input, Memory, State, maths

KEEPING, CHASING, BRAKING = 0.0, 1.0, 2.0


class DrivenCar(Component):
    """v' = -throttle - brake v, y' = v."""

    throttle = Input("m/s2", description="in [0, 1]")
    brake = Input("1/s", description="in [0, 1]")

    y = State("m", 0.0, output=True, description="position")
    v = State("m/s", 0.0, output=True, description="rate of the position")

    def derivatives(self) -> dict[str, Any]:
        return {"y": self.v, "v": -self.throttle - self.brake * self.v}


class FollowingCar(Component):
    """Keeping v' = 0, y' = v; chasing v' = 1, y' = -v; braking v' = -v, y' = -v.

    Of the distance d to the car ahead: keeping turns to chasing at d >= 15 and else to braking at d <= 5; chasing turns
    to keeping at d <= 10, braking to chasing at d >= 20. In the source a transition is taken at a step of its solver
    or where a zero crossing is found; here at a communication point.
    """

    ahead = Input("m", description="position of the car ahead")

    y = State("m", 0.0, output=True, description="position")
    v = State("m/s", 0.0, output=True, description="speed, or in keeping the rate of the position")
    mode = Memory("1", KEEPING, output=True, description="0 keeping, 1 chasing, 2 braking")

    def derivatives(self) -> dict[str, Any]:
        keeping, chasing = self.mode < 0.5, maths.logical_and(self.mode > 0.5, self.mode < 1.5)
        return {
            "y": maths.where(keeping, self.v, -self.v),
            "v": maths.where(keeping, 0.0, maths.where(chasing, 1.0, -self.v)),
        }

    def update(self) -> dict[str, Any]:
        distance = self.y - self.ahead
        from_keeping = maths.where(distance >= 15.0, CHASING, maths.where(distance <= 5.0, BRAKING, KEEPING))
        from_chasing = maths.where(distance <= 10.0, KEEPING, CHASING)
        from_braking = maths.where(distance >= 20.0, CHASING, BRAKING)
        others = maths.where(self.mode < 1.5, from_chasing, from_braking)
        return {"mode": maths.where(self.mode < 0.5, from_keeping, others)}
