"""The share of each vehicle in a total force, as a component of its own for other tools."""

from __future__ import annotations

from ..component import Component, Values
from ..declarations import Data, Input, Output, Parameter, Size
from ..trains.vehicles import REPEATED, SUBWAY, VEHICLES, distribute, pattern


class ForceDistribution(Component):
    """Forces of the vehicles for a total force, at least cost (Liu & Hou 2020, eqs. 52-55).

    Minimises sum(q F^2)/2 subject to sum(mu F) = force: over the motored vehicles for traction, over all for braking.
    """

    source = "Liu & Hou 2020, eqs. 52-55, solved over the vehicles allowed to act"
    note = "Taken literally, eqs. 54-55 solve over all vehicles and drop the trailers' traction: 46.7 % of it is lost."
    equations = (
        r"$F_k = \dfrac{\mu_k / q_k}{\sum_j \mu_j^2 / q_j}\,u$ over the vehicles $j, k$ allowed to act, else $F_k = 0$",
        r"with force $u$, vehicle_force $F_k$, the weights $\mu_k$ of the vehicles and cost $q_k$.",
    )

    vehicles = Size(6, description="number of vehicles")
    consist = Data(SUBWAY, convert=VEHICLES.read, description=f"{VEHICLES.description}; {REPEATED}")

    force = Input("N", description="total traction (+) or braking (-) force")

    cost = Parameter(
        "1", 0.1, tunable=True, shape=(vehicles,), minimum=1e-9, description="weight q of a vehicle's squared force"
    )

    vehicle_force = Output("N", shape=(vehicles,), description="force F of each vehicle")
    effective_force = Output("N", shape=(vehicles,), description="mu F of each vehicle, what acts on the train")

    def outputs(self) -> Values:
        rows = pattern(self.consist, self.vehicles)
        weights = [row.weight for row in rows]
        cost = [self.cost[k] for k in range(self.vehicles)]
        forces = distribute(self.force, weights, [row.motored for row in rows], cost)
        return {
            "vehicle_force": forces,
            "effective_force": [mu * force for mu, force in zip(weights, forces, strict=True)],
        }
