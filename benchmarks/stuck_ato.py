"""The component of benchmarks/protection_trial.py."""

from railcosim.components import Cailc, Parameter
from railcosim.components.maths import logical_and, where


class StuckAto(Cailc):
    """A `Cailc` whose force is stuck at a constant from a trip time on; what it reports of itself stays right."""

    stuck_from = Parameter("s", 0.0, description="trip time from which its force is stuck")
    stuck_force = Parameter("N", 400e3, description="what it is stuck at")

    def outputs(self):
        found = super().outputs()
        stuck = logical_and(self.trip_time >= 0.0, self.trip_time >= self.stuck_from)
        return {**found, "force": where(stuck, self.stuck_force, found["force"])}
