"""Designs: which points of the unit cube are tried. Every number is the same on every machine, for any chunks.

Raw bits come from Philox, a counter-based generator whose stream NumPy keeps from version to version; so the numbers of
a random run are those of its own number, however many runs there are, and a Sobol sequence or a Latin hypercube, which
belong together as a whole, is one table of the seed and the count.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

DESIGNS = ("grid", "random", "latin-hypercube", "sobol", "saltelli")
_NUMBERS, _SEEDS = range(2)
"""Streams of a study's seed that have nothing to do with one another."""
_BITS = 53
"""Of a number of a Sobol sequence; with SciPy's 30, one in some hundred large studies would hold a 0."""
_SMALLEST, _LARGEST = 2.0**-50, 1.0 - 2.0**-50
"""No share is 0 or 1, where a normal distribution is infinite."""


def random_numbers(seed: int, first: int, last: int, width: int) -> NDArray[np.float64]:
    """Uniform numbers of the runs from `first` to before `last`, (last - first, width)."""
    bits = _bits(seed, _NUMBERS, first * width, (last - first) * width)
    shares: NDArray[np.float64] = (bits >> np.uint64(11)) * np.float64(2.0**-53)
    return kept_inside(shares).reshape(last - first, width)


def noise_seeds(seed: int, first: int, last: int) -> list[int]:
    """A seed from 0 to 2**63 - 1 for each of the runs from `first` to before `last`."""
    found: list[int] = (_bits(seed, _SEEDS, first, last - first) >> np.uint64(1)).tolist()
    return found


def _bits(seed: int, stream: int, first: int, count: int) -> NDArray[np.uint64]:
    """`count` words of 64 bits from place `first` of a stream."""
    source = np.random.Philox(key=seed + (stream << 64))
    source.advance(first // 4)  # each count of its counter gives four words
    words: NDArray[np.uint64] = source.random_raw(first % 4 + count)
    return words[first % 4 :]


def table(design: str, seed: int, count: int, width: int) -> NDArray[np.float64]:
    """All points of a design that belong together, (count, width); `count` of Saltelli's is a multiple of width + 2."""
    if design == "saltelli":
        return _saltelli(seed, count // (width + 2), width)
    if design == "sobol":
        return _sobol(seed, count, width)
    from scipy.stats import qmc

    drawn: NDArray[np.float64] = qmc.LatinHypercube(width, rng=_generator(seed)).random(count)
    return kept_inside(drawn)


def _sobol(seed: int, count: int, width: int) -> NDArray[np.float64]:
    """The first points of a scrambled sequence, drawn to a power of two, without which SciPy warns."""
    from scipy.stats import qmc

    drawn: NDArray[np.float64] = qmc.Sobol(width, bits=_BITS, rng=_generator(seed)).random_base2(
        (count - 1).bit_length()
    )
    return kept_inside(drawn[:count])


def _saltelli(seed: int, base: int, width: int) -> NDArray[np.float64]:
    """Blocks of A, A with one column of B in turn, and B, as SALib reads them (Saltelli et al. 2010)."""
    points = _sobol(seed, base, 2 * width)
    a, b = points[:, :width], points[:, width:]
    blocks = np.repeat(a[:, None, :], width + 2, axis=1)
    for k in range(width):
        blocks[:, 1 + k, k] = b[:, k]
    blocks[:, -1] = b
    return blocks.reshape(base * (width + 2), width)


def _generator(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed)))


def kept_inside(shares: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shares that every distribution has a finite quantile for."""
    return np.clip(shares, _SMALLEST, _LARGEST)
