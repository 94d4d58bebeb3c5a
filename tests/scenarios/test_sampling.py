"""The sampling table of `docs/models/comfort_cruise.md`, section 6: what exchanging values every h seconds costs.

Worst deviations from the continuous loop over 350 s, of speeds in m/s and gaps in m, `figure-consistent`; the tanh law
with a gust of 0.5 m/s2, the bottom layer without. Measured for the specification with an independent implementation.
"""

import pytest

TANH, BOTTOM = {"comfort": True, "gust": 0.5}, {"comfort": False, "gust": 0.0}
TABLE = {
    # h: tanh gauss-seidel, tanh jacobi, bottom gauss-seidel, bottom jacobi
    0.01: ((0.002, 0.09), (0.006, 0.26), (0.007, 0.26), (0.020, 0.77)),
    0.05: ((0.011, 0.43), (0.032, 1.28), (0.033, 1.29), (0.099, 3.9)),
    0.1: ((0.022, 0.85), (0.065, 2.6), (0.066, 2.6), (0.198, 7.7)),
    0.2: ((0.043, 1.7), (0.131, 5.1), (0.132, 5.2), (0.398, 15.5)),
    0.5: ((0.109, 4.2), (0.332, 12.7), (0.334, 12.9), (1.01, 38.7)),
    1.0: ((0.221, 8.4), (0.686, 25.1), (0.680, 25.9), (2.09, 77.4)),
}
COLUMNS = [(law, algorithm) for law in (TANH, BOTTOM) for algorithm in ("gauss-seidel", "jacobi")]


CELLS = [
    pytest.param(
        h,
        law,
        algorithm,
        expected,
        id=f"{h}-{'tanh' if law is TANH else 'bottom'}-{algorithm}",
        marks=pytest.mark.long if h < 0.2 else (),
    )
    for h, cells in TABLE.items()
    for (law, algorithm), expected in zip(COLUMNS, cells, strict=True)
]


@pytest.mark.parametrize(("h", "law", "algorithm", "expected"), CELLS)
@pytest.mark.long
def test_the_table(deviation, h, law, algorithm, expected):
    """To the last printed digit."""
    for found, printed in zip(deviation(step=h, algorithm=algorithm, **law), expected, strict=True):
        last_digit = 10.0 ** -len(repr(printed).partition(".")[2])
        assert found == pytest.approx(printed, abs=0.51 * last_digit)
