"""Seeded faults: whatever fails, where and when it may, what a user is promised holds."""

import os
import sys

import pytest

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="forks, and signals of Linux")
_FIRST, _, _END = (os.environ.get("FAULT_SEEDS") or "0:10000").partition(":")
"""``17`` or ``0:10000``: the seeds of the campaign."""


def pieces(first, end, size=50):
    """Seeds in pieces: workers that share short tests end together."""
    return [pytest.param(range(k, min(k + size, end)), id=f"from {k}") for k in range(first, end, size)]


def survey(bench, seeds):
    from invariants import broken

    told = []
    for seed in seeds:
        found, case = broken(bench, seed)
        if found:
            again = f"FAULT_SEEDS={seed} pytest tests/orchestrator/faults -m campaign"
            told.append("\n".join([f"seed {seed}: {'; '.join(found)}", case, f"once more, alone: {again}"]))
    assert not told, f"{len(told)} of {len(seeds)} cases broke a promise\n\n" + "\n\n".join(told[:20])


@pytest.mark.parametrize("seeds", pieces(0, 10, 5))
def test_what_is_promised_holds_whatever_fails(bench, seeds):
    survey(bench, seeds)


@pytest.mark.long
@pytest.mark.parametrize("seeds", pieces(10, 130, 30))
def test_what_is_promised_holds_whatever_fails_more_often(bench, seeds):
    survey(bench, seeds)


@pytest.mark.campaign
@pytest.mark.parametrize("seeds", pieces(int(_FIRST), int(_END or int(_FIRST) + 1)))
def test_campaign(bench, seeds):
    """As many seeds as are asked for by ``FAULT_SEEDS``, ten thousand by default."""
    survey(bench, seeds)
