"""The campaign of docs/radio_campaign.md in small: the braking margin holds with the fallback, not without."""

import importlib.util
import sys
from pathlib import Path

import pytest
from railcosim.components import CATALOGUE
from railcosim.fmus.build import native_problem

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "radio_campaign.py"
SEED = 1
TELLING = (14, 15, 27, 28, 42)
"""Runs of the campaign in which the margin goes negative without the fallback."""

pytestmark = [
    pytest.mark.skipif(not SCRIPT.exists(), reason="the benchmarks are not here"),
    pytest.mark.skipif(bool(native_problem(CATALOGUE["RadioLink"])), reason="long runs need native FMUs"),
]


@pytest.fixture(scope="module")
def script():
    name = "railcosim_radio_campaign"
    spec = importlib.util.spec_from_file_location(name, SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[name]


def margins(script, numbers):
    """Smallest braking margins by variant, one for each run."""
    found = {variant: [] for variant in script.VARIANTS}
    for outcome in script.campaign(SEED, numbers, list(script.VARIANTS)):
        found[outcome.variant].append(outcome.margin)
    return found


def test_the_draws_are_reproducible_and_within_what_is_claimed(script):
    draws = [script.draw(SEED, number) for number in range(500)]
    assert draws[17] == script.draw(SEED, 17)
    assert len(set(draws)) == 500
    assert {x.law for x in draws} == set(script.LAWS)
    assert 1.9 < max(x.outage for x in draws) <= 2.0
    assert 0.19 < max(x.loss for x in draws) <= 0.2
    assert 0.49 < max(x.delay for x in draws) <= 0.5
    assert {x.trains for x in draws} == {4, 5, 6}
    assert 0.95 < max(x.strength for x in draws) <= script.HARDEST
    assert 200 < sum(x.burst > 0.0 for x in draws) < 300
    assert max(script.gap(x.speed, script.RESERVE) for x in draws) < 600.0


def test_the_policy_leaves_the_reserve_as_margin(script):
    left = script.gap(50.0, 2.0) - script.STANDSTILL
    assert left - 50.0**2 / 2 * (1 / script.BRAKING - 1 / script.HARDEST) == pytest.approx(100.0)


@pytest.mark.long
def test_five_telling_runs(script):
    found = margins(script, TELLING)
    assert max(found["no fallback"]) < 0.0
    for variant in ("perfect radio, no fallback", *script.SAFE):
        assert min(found[variant]) > 0.0


@pytest.mark.long
def test_the_radio_is_what_was_drawn(script):
    drawn = script.draw(SEED, TELLING[0])
    system = script.system_of(drawn)
    assert system.seed == script.system_of(drawn, fallback=False).seed  # paired
    assert script.simulate(drawn, "fallback") == script.simulate(drawn, "fallback")
    assert script.simulate(drawn, "fallback").age == script.simulate(drawn, "no fallback").age > drawn.outage


@pytest.mark.campaign
def test_fifty_runs(script):
    found = margins(script, range(50))
    assert sum(margin < 0.0 for margin in found["no fallback"]) == 7
    for variant in ("perfect radio, no fallback", *script.SAFE):
        assert min(found[variant]) > 0.0
