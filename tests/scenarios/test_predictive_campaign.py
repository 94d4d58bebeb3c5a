"""The campaign of benchmarks/predictive_campaign.py: a sample of its draws in the long tier, all 500 as a campaign."""

import importlib
import sys
from pathlib import Path

import pytest
from railcosim.components import CATALOGUE
from railcosim.fmus.build import native_problem

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
LAW = ("DistributedMpc",)
SEED, RUNS, SAMPLE = 2, 500, 3
pytestmark = [
    pytest.mark.skipif(not BENCHMARKS.is_dir(), reason="the benchmarks are not here"),
    pytest.mark.skipif(bool(native_problem(CATALOGUE["DistributedMpc"])), reason="long runs need native FMUs"),
]


@pytest.fixture(scope="module")
def campaign():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        yield importlib.import_module("predictive_campaign")
    sys.modules.pop("predictive_campaign")


def negative(campaign, numbers):
    """Numbers of the draws whose braking margin goes below zero with the guard, as the controller is shipped."""
    found = campaign.outcomes(SEED, numbers, LAW, ("fallback and guard",))
    return [x.drawn.number for x in found if x.margin < 0.0]


@pytest.mark.long
def test_the_gap_is_kept_in_a_sample_of_draws(campaign):
    assert negative(campaign, range(0, RUNS, RUNS // SAMPLE)) == []


@pytest.mark.campaign
def test_the_gap_is_kept_in_every_draw(campaign):
    assert negative(campaign, range(RUNS)) == []
