"""What came out of a run says so in a line or two, and gives its signals as a mapping does."""

from pathlib import Path

import pytest
from railcosim.orchestrator import System, load, run
from railcosim.orchestrator.errors import SignalError

TOYS = Path(__file__).parents[2] / "toys.py"


def test_a_run_is_a_mapping():
    outcome = run(load("comfort_cruise", stop_time=1.0))
    assert list(outcome) == list(outcome.results)
    assert len(outcome) == len(dict(outcome)) == len(outcome.results)
    assert "train[1].speed" in outcome
    assert dict(outcome.items())["train[1].speed"] is outcome["train[1].speed"]
    with pytest.raises(SignalError, match=r"one of each instance: train\[1\].speed"):
        outcome["train.speed"]
    assert outcome == outcome  # noqa: PLR0124
    assert outcome in {outcome}


def test_the_representation_of_a_run():
    told = repr(run(load("comfort_cruise", preset="as-stated", stop_time=60.0)))
    assert told.startswith("<Run of comfort_cruise as-stated: completed; ")
    assert "; 3 of 4 requirements pass; <Results of 38 signals at 601 points from 0 to 60 s: train[i]." in told
    assert len(told) < 500


def test_it_names_what_was_found_and_stays_short(tmp_path):
    system = System(stop_time=1.0, step=0.1)
    for k in range(200):
        system.add(f"{'cart' * 60}[{k + 1}]", f"{TOYS}:Cart", speed=-1.0)
    told = repr(run(system, kind="plain", output=tmp_path))
    assert "reversing: cartcart" in told
    assert len(told) < 4000
