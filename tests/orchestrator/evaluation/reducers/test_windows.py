import numpy as np
import pytest
from railcosim.orchestrator.evaluation.reducers import Selection, Span, at

TIME = np.arange(60.0)
ROWS = np.random.default_rng(5).normal(size=(2, 3, 60))


@pytest.mark.parametrize("overlap", [0, 1])
@pytest.mark.parametrize("gaps", [0, 1, 15, 16, 29])  # beyond 16 stretches, points are had one by one
def test_what_counts_is_had_whatever_is_left_out(gaps, overlap):
    span = Span(None, None, [(2.0 * k + 1.0, 2.0 * k + 1.0) for k in range(gaps)])
    selection = Selection.of(TIME, overlap, span)
    counts = ~np.isin(TIME, [2.0 * k + 1.0 for k in range(gaps)])
    assert (at(ROWS, selection.kept) == ROWS[..., counts & (np.arange(60) >= overlap)]).all()
    assert (selection.places == np.flatnonzero(counts)).all()
    inside = [counts[k] and counts[k + 1] for k in range(59)]
    assert (at(np.diff(ROWS), selection.between) == np.diff(ROWS)[..., inside]).all()
    assert selection.lengths.tolist() == [1.0] * sum(inside)


def test_nothing_counts_behind_the_end():
    selection = Selection.of(TIME, 0, Span(100.0, None))
    assert at(ROWS, selection.kept).shape == (2, 3, 0)
    assert not selection.places.size
