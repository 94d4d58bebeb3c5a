"""The protection campaign of benchmarks/protection_campaign.py: some of its 500 runs."""

import importlib
import subprocess
import sys
from pathlib import Path

import pytest
from railcosim.orchestrator.run.execution import evaluate

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
SMOKE = (0, 1, 13, 4, 5)


@pytest.fixture(scope="module")
def campaign():
    """The module of a single run; the table and the command are in benchmarks/protection_campaign.py."""
    pytest.importorskip("casadi")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(BENCHMARKS))
        yield importlib.import_module("protection_trial")


def keeps_its_promises(campaign, number):
    """One paired draw; gives what happened with and without the protection."""
    case, with_it, without = campaign.trial(number, 1, paired=True)
    assert not with_it.broken, case
    assert not without.broken, case
    assert with_it.peak <= with_it.bound
    assert with_it.peak <= without.peak + 1e-9
    return case, with_it, without


# A force that is late and a limit over position; a limit that falls; a slow sampling; a noisy sensor; full traction.
@pytest.mark.parametrize("number", SMOKE)
@pytest.mark.long
def test_a_smoke(campaign, number):
    case, with_it, without = keeps_its_promises(campaign, number)
    assert len(case.faults) == 1
    if case.faults == ("full traction",):
        assert with_it.peak < 0.1
        assert without.peak > 10.0


def test_the_protection_does_not_weaken_a_controller_that_brakes_harder(campaign):
    """The controller brakes with 1.2 m/s2, the service brake with 0.9; both called for at the same sample.

    While the brake replaced the controller's force this run reached 0.711 m/s above the limit, without it 0.478.
    """
    _, with_it, without = keeps_its_promises(campaign, 261)
    assert with_it.braked_at is not None
    assert with_it.peak == pytest.approx(without.peak, abs=1e-6)
    assert with_it.peak == pytest.approx(0.478, abs=1e-3)


@pytest.mark.parametrize(
    "number",
    [
        *(pytest.param(number, marks=pytest.mark.long) for number in range(20) if number not in SMOKE),
        *(pytest.param(number, marks=pytest.mark.campaign) for number in range(20, 50)),
    ],
)
def test_fifty_runs(campaign, number):
    keeps_its_promises(campaign, number)


def test_a_draw_is_its_number_and_the_seed(campaign):
    assert campaign.draw(9, 1) == campaign.draw(9, 1)
    assert campaign.draw(9, 1) != campaign.draw(9, 2)
    assert campaign.draw(9, 1).seed != campaign.draw(19, 1).seed
    kinds = {fault for number in range(10) for fault in campaign.draw(number, 1).faults}
    assert kinds == set(campaign.SINGLE)


def test_the_judge_sees_a_brake_that_does_not_act(campaign):
    """The run without protection, judged as if it had one: the checks are not empty."""
    case = campaign.draw(5, 1)
    outcome = campaign.judge(campaign.run(campaign.system(case, intervene=False)), case, intervene=True)
    assert "a brake that was called for does not act" in outcome.broken
    assert any(text.startswith("peak") for text in outcome.broken)


@pytest.mark.parametrize(
    ("signal", "text"),
    [
        ("protection.service_brake", "no brake command within one sample"),
        ("ato.force", "brakes less than the ATO would"),
        ("ato.barrier_reached", "flag and status"),
        ("monitor.largest_overspeed", "the requirement does not say"),
    ],
)
def test_the_judge_sees_a_signal_that_stays_silent(campaign, signal, text):
    """A brake command one sample late, a barrier's flag that does not rise, a monitor that sees nothing, and so on."""
    case = campaign.draw(5, 1)
    outcome = campaign.run(campaign.system(case, intervene=True))
    values = outcome.results[signal]
    where = values.argmax() if signal == "protection.service_brake" else slice(None)
    values[where] = -400e3 if signal == "ato.force" else 0.0  # braking harder than the protection did
    evaluate(outcome, outcome.results)  # 0 m/s above the limit is not a violation
    broken = campaign.judge(outcome, case, intervene=True).broken
    assert broken
    assert all(text in found for found in broken)


@pytest.mark.long
def test_the_command(tmp_path):
    """Two runs: a table with a line for each, a summary, and the exit code of promises that are kept."""
    file = tmp_path / "table.md"
    command = [sys.executable, BENCHMARKS / "protection_campaign.py", "--runs", "2", "--table", file]
    done = subprocess.run([*command, "--without-protection"], capture_output=True, text=True, check=True)
    assert "Every promise was kept in every run." in done.stdout
    assert "2/2 runs, 0 with a promise not kept" in done.stderr
    assert file.read_text(encoding="utf-8").count("\n") == 4
