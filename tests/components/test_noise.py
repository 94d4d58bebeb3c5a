"""Random numbers: the published generator, the published quantile, and the statistics they promise."""

import functools
import math

import numpy as np
import pytest
from railcosim.components import noise
from scipy import stats

_GOLDEN = 0x9E3779B97F4A7C15


def test_scramble_is_splitmix64():
    """Reference: the sequence from seed 1234567 that Vigna's splitmix64.c gives (published on Rosetta Code).

    The scramble adds the increment itself, so the k-th number of the sequence is the scramble of seed + k increments.
    """
    sequence = [noise._scramble((1234567 + k * _GOLDEN) & (2**64 - 1)) for k in range(5)]
    assert sequence == [
        6457827717110365317,
        3203168211198807973,
        9817491932198370423,
        4593380528125082431,
        16408922859458223821,
    ]


def test_bits_depend_on_seed_stream_and_index():
    seen = {noise.bits(*key) for key in [(1, 2, 3), (1, 3, 2), (2, 1, 3), (3, 2, 1), (1, 2, 4), (1, 2 + (1 << 32), 3)]}
    assert len(seen) == 6
    assert noise.bits(1, 2, 3) == noise.bits(1, 2, 3)
    assert noise.bits(1, 2, -1) != noise.bits(1, 2, 1)


def test_quantile_against_scipy():
    """Reference: `scipy.stats.norm.ppf`, to 1e-14 of the larger of 1 and the value; in the lower tail relative.

    Above 1/2 the probability itself is only known to 1e-16, which the steep quantile magnifies: less is asked there.
    """
    body = np.linspace(1e-6, 0.5, 20001)
    ours, theirs = np.array([noise.quantile(float(p)) for p in body]), stats.norm.ppf(body)
    assert (np.abs(ours - theirs) / np.maximum(1.0, np.abs(theirs))).max() < 1e-14
    tail = 2.0 ** -np.arange(2.0, 54.0)
    ours = np.array([noise.quantile(float(p)) for p in tail])
    assert np.abs(ours / stats.norm.ppf(tail) - 1.0).max() < 1e-14
    assert noise.quantile(0.5) == 0.0
    for p in (0.01, 0.0625, 0.2, 0.45):
        assert noise.quantile(1.0 - p) == pytest.approx(-noise.quantile(p), rel=1e-14)


def test_quantile_at_the_ends_of_what_can_be_drawn_is_finite():
    low, high = 0.5 * 2.0**-52, (2.0**52 - 0.5) * 2.0**-52
    assert noise.quantile(low) == pytest.approx(stats.norm.ppf(low), rel=1e-14)
    assert noise.quantile(high) == pytest.approx(-stats.norm.ppf(low), rel=1e-14)


def test_logarithm_against_the_math_module():
    """Reference: `math.log`, to 1e-15 relative, also beside 1 where the result is small."""
    values = [
        *np.geomspace(1e-300, 1e300, 5001),
        *np.linspace(0.5, 2.0, 5001),
        1 - 2**-53,
        1 + 2**-52,
        0.7071067811865475,
    ]
    for x in map(float, values):
        assert noise.logarithm(x) == pytest.approx(math.log(x), rel=1e-15, abs=0.0), x


def test_normals_have_the_moments_and_the_shape_of_a_normal():
    """40 000 numbers: mean, variance, skewness and kurtosis within five standard errors; Kolmogorov-Smirnov."""
    n = 40_000
    drawn = np.array([noise.normal(42, 0, k) for k in range(n)])
    assert abs(drawn.mean()) < 5.0 / math.sqrt(n)
    assert abs(drawn.var() - 1.0) < 5.0 * math.sqrt(2.0 / n)
    assert abs(stats.skew(drawn)) < 5.0 * math.sqrt(6.0 / n)
    assert abs(stats.kurtosis(drawn)) < 5.0 * math.sqrt(24.0 / n)
    assert stats.kstest(drawn, "norm").pvalue > 1e-3


def test_uniforms_fill_the_interval_evenly():
    drawn = np.array([noise.uniform(7, 3, k) for k in range(20_000)])
    assert drawn.min() >= 0.0
    assert drawn.max() < 1.0
    assert stats.kstest(drawn, "uniform").pvalue > 1e-3


@functools.cache
def normals(seed, stream):
    return np.array([noise.normal(seed, stream, k) for k in range(10_000)])


@pytest.mark.parametrize(
    ("first", "second"),
    [((1, 0), (2, 0)), ((1, 0), (1, 1)), ((1, 0), (1, 1 << 32)), ((1, 1), (1, 1 + (1 << 32))), ((0, 1), (1, 0))],
)
def test_streams_and_seeds_are_independent(first, second):
    """Correlation of 10 000 pairs, also shifted by one, within five standard errors."""
    a, b = normals(*first), normals(*second)
    for x, y in ((a, b), (a[1:], b[:-1]), (a[1:], a[:-1])):
        assert abs(np.corrcoef(x, y)[0, 1]) < 5.0 / math.sqrt(len(a))


def test_cells_of_an_array_are_streams_of_their_own():
    cells = noise.cells("normal", 5, 1, 9, (2, 2))
    assert cells.shape == (2, 2)
    assert len(set(cells.flat)) == 4
    assert cells[0, 0] == noise.normal(5, 1, 9)
    assert cells[1, 1] == noise.normal(5, 1 + (3 << 32), 9)
    assert noise.cells("uniform", 5, 1, 9, ()) == noise.uniform(5, 1, 9)
