"""Points of the unit cube: the same for any chunks, as even as their designs promise."""

import numpy as np
import pytest
from railcosim.orchestrator.study.design import sampling
from railcosim.orchestrator.study.design.sampling import noise_seeds, random_numbers, table


def test_random_numbers_are_those_of_their_run():
    whole = random_numbers(7, 0, 1000, 3)
    parts = [random_numbers(7, first, min(first + 77, 1000), 3) for first in range(0, 1000, 77)]
    assert np.array_equal(whole, np.concatenate(parts))
    assert random_numbers(7, 5, 9, 0).shape == (4, 0)
    assert not np.array_equal(whole, random_numbers(8, 0, 1000, 3))


def test_random_numbers_are_uniform_and_not_correlated():
    drawn = random_numbers(1, 0, 20_000, 4)
    assert drawn.mean(axis=0) == pytest.approx(0.5, abs=0.01)
    assert drawn.var(axis=0) == pytest.approx(1 / 12, abs=0.002)
    assert np.corrcoef(drawn.T) == pytest.approx(np.eye(4), abs=0.03)


def test_the_stream_stays_as_it_is():
    """Studies of former versions are run again to the same bits."""
    assert noise_seeds(7, 0, 2) == [8139319885621606286, 3403777856573314987]
    assert random_numbers(7, 0, 1, 2).tolist() == [[0.8720734548204873, 0.29536538151378355]]


def test_seeds_of_noise_differ_and_are_those_of_their_run():
    seeds = noise_seeds(7, 0, 10_000)
    assert len(set(seeds)) == 10_000
    assert min(seeds) >= 0
    assert max(seeds) < 2**63
    assert noise_seeds(7, 4001, 4003) == seeds[4001:4003]
    assert noise_seeds(2**63 - 1, 0, 1) != noise_seeds(0, 0, 1)


@pytest.mark.parametrize("count", [16, 100])
def test_a_latin_hypercube_has_one_point_in_each_slice(count):
    points = table("latin-hypercube", 3, count, 2)
    assert (np.sort((points * count).astype(int), axis=0) == np.arange(count)[:, None]).all()
    assert np.array_equal(points, table("latin-hypercube", 3, count, 2))


def test_a_sobol_sequence_fills_every_box_once():
    points = table("sobol", 3, 64, 2)
    for shape in ((64, 1), (8, 8), (1, 64), (16, 4)):
        boxes = (points * shape).astype(int)
        assert len({tuple(box) for box in boxes.tolist()}) == 64
    assert np.array_equal(table("sobol", 3, 50, 2), points[:50])
    assert table("sobol", 3, 1, 2).shape == (1, 2)


def test_saltellis_blocks_differ_from_their_first_row_in_one_column_each():
    blocks = table("saltelli", 3, 8 * 5, 3).reshape(8, 5, 3)
    a, b = blocks[:, 0], blocks[:, -1]
    assert (a != b).all()
    for k in range(3):
        expected = a.copy()
        expected[:, k] = b[:, k]
        assert np.array_equal(blocks[:, 1 + k], expected)


def test_no_share_is_an_end():
    kept = sampling.kept_inside(np.array([0.0, 0.5, 1.0]))
    assert 0 < kept[0] < kept[1] == 0.5 < kept[2] < 1
