"""Counter-based random numbers: the same bits in Python and in C, at any moment, without a sequence to replay.

SplitMix64 (Steele, Lea, Flood 2014) scrambles seed, stream and index into 64 bits; algorithm AS 241 (Wichura 1988)
turns them into normals. Its logarithm is our own, made of +, -, * and / only, because a C library's may differ in
the last bit.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

_MASK = (1 << 64) - 1
_LN2_HIGH = 0.693147180369123816490
_LN2_LOW = 1.90821492927058770002e-10


def bits(seed: int, stream: int, index: int) -> int:
    """64 random bits that belong to this seed, stream and index."""
    state = _scramble(seed & _MASK)
    state = _scramble(state ^ (stream & _MASK))
    return _scramble(state ^ (index & _MASK))


def uniform(seed: int, stream: int, index: int) -> float:
    """A number on [0, 1) with 53 random bits."""
    return (bits(seed, stream, index) >> 11) * 2.0**-53


def normal(seed: int, stream: int, index: int) -> float:
    """A standard normal number: the quantile of a uniform one on (0, 1)."""
    return quantile(((bits(seed, stream, index) >> 12) + 0.5) * 2.0**-52)


def _scramble(x: int) -> int:
    x = (x + 0x9E3779B97F4A7C15) & _MASK
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & _MASK
    return x ^ (x >> 31)


def logarithm(x: float) -> float:
    """Natural logarithm of a normal positive number, to 1e-15 relative, in basic arithmetic only."""
    mantissa, exponent = math.frexp(x)
    if mantissa < 0.70710678118654752440:
        mantissa, exponent = 2.0 * mantissa, exponent - 1
    s = (mantissa - 1.0) / (mantissa + 1.0)
    z = s * s
    series = 0.0
    for odd in (21.0, 19.0, 17.0, 15.0, 13.0, 11.0, 9.0, 7.0, 5.0, 3.0):
        series = (series + 1.0 / odd) * z
    return exponent * _LN2_HIGH + (exponent * _LN2_LOW + (2.0 * s + 2.0 * s * series))


# Coefficients of AS 241, routine PPND16: three rational approximations of degree 7, highest power first.
_CENTRE = (
    (2509.0809287301226727, 33430.575583588128105, 67265.770927008700853, 45921.953931549871457,
     13731.693765509461125, 1971.5909503065514427, 133.14166789178437745, 3.387132872796366608),
    (5226.495278852854561, 28729.085735721942674, 39307.89580009271061, 21213.794301586595867,
     5394.1960214247511077, 687.1870074920579083, 42.313330701600911252, 1.0),
)  # fmt: skip
_MIDDLE = (
    (7.7454501427834140764e-4, 0.0227238449892691845833, 0.24178072517745061177, 1.27045825245236838258,
     3.64784832476320460504, 5.7694972214606914055, 4.6303378461565452959, 1.42343711074968357734),
    (1.05075007164441684324e-9, 5.475938084995344946e-4, 0.0151986665636164571966, 0.14810397642748007459,
     0.68976733498510000455, 1.6763848301838038494, 2.05319162663775882187, 1.0),
)  # fmt: skip
_TAIL = (
    (2.01033439929228813265e-7, 2.71155556874348757815e-5, 0.0012426609473880784386, 0.026532189526576123093,
     0.29656057182850489123, 1.7848265399172913358, 5.4637849111641143699, 6.6579046435011037772),
    (2.04426310338993978564e-15, 1.4215117583164458887e-7, 1.8463183175100546818e-5, 7.868691311456132591e-4,
     0.0148753612908506148525, 0.13692988092273580531, 0.59983220655588793769, 1.0),
)  # fmt: skip


def quantile(p: float) -> float:
    """Standard normal quantile of a probability on (0, 1), to 1e-15 relative (AS 241)."""
    q = p - 0.5
    if abs(q) <= 0.425:
        return q * _ratio(_CENTRE, 0.180625 - q * q)
    r = math.sqrt(-logarithm(p if q < 0.0 else 1.0 - p))
    value = _ratio(_MIDDLE, r - 1.6) if r <= 5.0 else _ratio(_TAIL, r - 5.0)
    return -value if q < 0.0 else value


def _ratio(polynomials: tuple[tuple[float, ...], tuple[float, ...]], r: float) -> float:
    numerator, denominator = 0.0, 0.0
    for high, low in zip(*polynomials, strict=True):
        numerator = numerator * r + high
        denominator = denominator * r + low
    return numerator / denominator


def cells(distribution: str, seed: int, stream: int, index: int, shape: tuple[int, ...]) -> Any:
    """One number, or an array of independent ones, of a declared `Noise`.

    Args:
        distribution: ``"normal"`` or ``"uniform"``.
        seed: of the instance.
        stream: which `Noise` of the component, below 2^32.
        index: counts the intervals over which a value is held.
        shape: of the array; empty for a scalar.
    """
    draw = normal if distribution == "normal" else uniform
    if not shape:
        return draw(seed, stream, index)
    # The element's number goes into the upper half of the stream, so that no two streams meet.
    return np.array([draw(seed, stream + (k << 32), index) for k in range(math.prod(shape))]).reshape(shape)
