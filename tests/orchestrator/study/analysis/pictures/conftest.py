"""Axes to draw into, without a page around them: laying out and writing one takes longer than all else."""

import pytest
from matplotlib.figure import Figure


@pytest.fixture
def axes():
    """`axes()` or `axes(4)`: axes of a figure of their own."""

    def make(count=1, **more):
        found = Figure(figsize=(6, 4)).subplots(1, count, squeeze=False, **more)[0]
        return found[0] if count == 1 else list(found)

    return make


def labels(ax):
    return [str(text.get_text()) for text in ax.get_legend().get_texts()]


@pytest.fixture
def said():
    """What the legend of some axes says."""
    return labels
