"""Seeded faults: whatever fails, where and when it may, what a user is promised holds."""

import os
import sys

import pytest

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="forks, and signals of Linux")
_CHOSEN = os.environ.get("FAULT_SEEDS", "")
"""``17`` or ``0:10000``: the seeds of the campaign."""


def survey(bench, seeds):
    from invariants import broken

    told = []
    for seed in seeds:
        found, case = broken(bench, seed)
        if found:
            again = f"FAULT_SEEDS={seed} pytest tests/orchestrator/faults -m campaign"
            told.append("\n".join([f"seed {seed}: {'; '.join(found)}", case, f"once more, alone: {again}"]))
    assert not told, f"{len(told)} of {len(seeds)} cases broke a promise\n\n" + "\n\n".join(told[:20])


@pytest.mark.parametrize("begin", range(0, 200, 50))
def test_what_is_promised_holds_whatever_fails(bench, begin):
    survey(bench, range(begin, begin + 50))


@pytest.mark.long
@pytest.mark.parametrize("begin", range(200, 3200, 50))  # short ones: workers end together
def test_what_is_promised_holds_whatever_fails_three_thousand_times(bench, begin):
    survey(bench, range(begin, begin + 50))


@pytest.mark.campaign
def test_campaign(bench):
    """As many seeds as are asked for by ``FAULT_SEEDS``, ten thousand by default."""
    first, _, end = (_CHOSEN or "0:10000").partition(":")
    survey(bench, range(int(first), int(end) if end else int(first) + 1))
