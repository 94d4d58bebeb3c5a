"""What not to do: the observer with its measurement frozen over a sample, instead of its innovation. For comparison."""

from railcosim.components import FaultTolerantCruise


class NaiveCruise(FaultTolerantCruise):
    """The fault-tolerant cruise (reconstructed) with an observer that follows the held measurement."""

    def _rates(self, innovation, sample, j, gains):
        del innovation

        def rates(x):
            held = (sample.position[j] - x[0], sample.speed[j] - x[1])
            return super(NaiveCruise, self)._rates(held, sample, j, gains)(x)

        return rates
