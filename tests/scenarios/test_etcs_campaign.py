"""The ETCS campaign of benchmarks/etcs_campaign.py: a sample of its 2000 runs in the long tier, all as a campaign."""

import importlib
from pathlib import Path

import pytest
from railcosim.components import EtcsSupervision
from railcosim.fmus.build import native_problem
from railcosim.orchestrator.study import Row

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
SAMPLE = 100
"""Every seventh run, of those on the hills and of the FLIRT's from Fribourg to Bern: four models to build, not nine."""
native = pytest.mark.skipif(bool(native_problem(EtcsSupervision)), reason="needs native FMUs")


@pytest.fixture(scope="module")
def campaign():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        yield importlib.import_module("etcs_campaign")


def judged(campaign, cases, *, off=False):
    """What the runs break, by number."""
    rows = campaign.run(cases, off=off)
    return {case.number: texts for case in cases if (texts := campaign.broken(case, rows[case.number]))}


@native
@pytest.mark.long
def test_no_run_of_a_sample_is_beyond_the_tolerance(campaign):
    cases = [campaign.draw(number, 1) for number in range(0, 2000, 7)]
    sample = [case for case in cases if case.line == "hills" or (case.line, case.train) == ("Fribourg-Bern", "FLIRT")]
    assert {case.controller for case in sample[:SAMPLE]} == set(campaign.CONTROLLERS)
    assert {case.train for case in sample[:SAMPLE]} == set(campaign.TRAINS)
    assert judged(campaign, sample[:SAMPLE]) == {}


@native
@pytest.mark.long
def test_the_campaign_fails_with_the_supervision_off(campaign):
    cases = [case for number in range(4, 400, 5) if (case := campaign.draw(number, 1)).line == "hills"][:5]
    assert {case.controller for case in cases} == {"full traction"}
    assert judged(campaign, cases, off=True).keys() == {case.number for case in cases}


@native
@pytest.mark.campaign
def test_no_run_of_two_thousand_is_beyond_the_tolerance(campaign):
    assert judged(campaign, [campaign.draw(number, 1) for number in range(2000)]) == {}


def test_a_draw_is_its_number_and_the_seed(campaign):
    assert campaign.draw(9, 1) == campaign.draw(9, 1)
    assert campaign.draw(9, 1).settings != campaign.draw(9, 2).settings


def test_the_rail_is_never_worse_than_the_safe_deceleration_has_it(campaign):
    """At 20 m/s, 0.6 m/s2 of a train without turning parts: 9.81 (0.161 + 7.5 / 116) = 2.2137 m/s2 on a dry rail."""
    assert campaign.worst_adhesion(((0.0, 0.9), (15.0, 0.6)), 20.0, 0.0) == pytest.approx(0.6 / 2.2137, rel=1e-4)


@pytest.mark.parametrize(
    ("excess", "farthest", "status", "said"),
    [
        (0.1, -5.0, "completed", []),
        (9.0, -5.0, "completed", ["9.000 m/s above limit and dV_ebi, "]),
        (0.1, 25.0, "completed", ["25.00 m beyond the supervised location"]),
        (0.0, 0.0, "failed", ["failed: "]),
    ],
)
def test_the_judge_sees_what_is_broken(campaign, excess, farthest, status, said):
    metrics = {"excess": excess, "farthest": farthest, "acceleration": 1.0}
    found = campaign.broken(campaign.draw(4, 1), Row(status, metrics=metrics))
    assert len(found) == len(said)
    assert all(text.startswith(start) for text, start in zip(found, said, strict=True))
