"""Columns survive the way into a page and back, as far as single precision lets them."""

import base64
import zlib

import numpy as np
import pytest
from railcosim.orchestrator.report.payload import is_even, pack


def unpack(packed, points):
    """As the page's script does it."""
    raw = zlib.decompress(base64.b64decode(packed.text), wbits=-15)
    single = np.frombuffer(raw, np.uint8).reshape(4, points).T.copy().view("<f4")[:, 0]
    return single.astype(np.float64) + packed.offset


@pytest.mark.parametrize(
    "values",
    [
        np.linspace(1e6, 1.2e6, 1001),
        np.sin(np.arange(300.0)),
        np.array([True, False, True]),
        np.arange(5),
        np.array([2.5]),
        np.array([]),
    ],
)
def test_a_column_and_its_loss(values):
    packed = pack(values)
    back = unpack(packed, len(values))
    reach = float(values.max()) - float(values.min()) if len(values) else 0.0
    assert np.abs(back - values).max(initial=0.0) <= packed.loss * reach * (1.0 + 1e-15)
    assert packed.loss <= 2.0**-24


def test_what_is_not_finite_stays_so():
    values = np.array([1.0, np.nan, np.inf, -np.inf, 3.0])
    np.testing.assert_array_equal(unpack(pack(values), 5), values)
    assert pack(values).loss == 0.0


def test_far_positions_keep_millimetres():
    """At 1200 km a number in single precision alone is 6 cm off."""
    assert pack(np.linspace(1.2e6, 1.21e6, 5000)).loss * 1e4 < 1e-3


@pytest.mark.parametrize(
    ("time", "even"),
    [([], True), ([1.0], True), ([0.0, 0.1, 0.2, 0.3], True), ([0.0, 0.1, 0.25], False)],
)
def test_even_times(time, even):
    assert is_even(np.array(time)) is even
