"""A Gaussian disturbance on every carriage."""

from __future__ import annotations

from ..component import Component, Values
from ..declarations import Noise, Output, Parameter, Size


class GaussianDisturbance(Component):
    """Independent normal disturbances of a train's carriages (reconstructed after Zhang & Chen 2022).

    Each value is held for ``hold``, and for a whole communication step where that is longer. The source runs its
    experiment under Gaussian disturbances; their size and holding time are chosen here.
    """

    source = "Zhang & Chen 2022 (arXiv 2211.02242): Gaussian disturbance; size and holding time chosen"
    equations = (
        r"$d_j = \sigma\,w_j$ with deviation $\sigma$ and independent standard normal $w_j$, drawn anew every hold.",
    )
    note = "Reconstructed: the source's variance and holding time are not known; both are ours."

    carriages = Size(3, description="number of carriages")

    deviation = Parameter("m/s2", 0.02, tunable=True, minimum=0.0, description="standard deviation")
    hold = Parameter("s", 0.01, minimum=1e-6, description="how long a value is held")

    gauss = Noise(hold, shape=(carriages,), description="one stream for each carriage")

    disturbance = Output("m/s2", shape=(carriages,), description="disturbing force per mass of each carriage")

    def outputs(self) -> Values:
        return {"disturbance": self.deviation * self.gauss}
