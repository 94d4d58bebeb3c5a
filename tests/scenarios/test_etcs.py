"""A FLIRT under ETCS over a Swiss main line, and five of them in virtual coupling."""

import pytest
from railcosim.components import EtcsSupervision
from railcosim.fmus.build import native_problem
from railcosim.orchestrator import load, run

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(bool(native_problem(EtcsSupervision)), reason="needs native FMUs"),
]


def judged(name, preset):
    """Metrics by name and index, and the requirements that fail."""
    result = run(load(name, preset=preset))
    metrics = {
        f"{metric.name}{index or ''}": value for metric in result.metrics for index, value in metric.values.items()
    }
    return metrics, {verdict.name for verdict in result.requirements if verdict.verdict != "pass"}


def test_a_driver_reaches_bern_without_an_intervention():
    metrics, failed = judged("fribourg_bern", None)
    assert failed == set()
    assert metrics["service_braked"] == metrics["emergency_braked"] == metrics["cut_off"] == 0.0
    assert metrics["arrival"] == pytest.approx(1207.0, abs=5.0)
    assert metrics["stop_short"] == pytest.approx(2.14, abs=0.5)
    assert abs(metrics["energy_residual"]) < 1e-6 * metrics["energy"]
    assert metrics["overspeed_peak"] < 0.0


def test_at_full_traction_the_supervision_alone_keeps_the_limits():
    metrics, failed = judged("fribourg_bern", "full-traction")
    assert failed == {"arrives"}
    assert metrics["overspeed_peak"] == pytest.approx(2.38, abs=0.05)
    assert metrics["emergency_braked"] > 100.0
    _, without = judged("fribourg_bern", "unsupervised")
    assert without == {"keeps_limits", "keeps_authority", "not_tripped", "arrives"}


def test_what_a_movement_authority_costs_in_headway():
    """A relative braking distance costs less than an absolute one; the law by itself keeps the least."""
    headways = {}
    for preset in (None, "absolute", "uncoupled"):
        metrics, failed = judged("virtual_coupling", preset)
        assert failed == set()
        assert all(metrics[f"service_braked{i}"] == 0.0 for i in range(1, 6))
        headways[preset] = sum(metrics[f"headway_mean{i}"] for i in range(2, 6)) / 4
    assert headways[None] == pytest.approx(37.0, abs=1.0)
    assert headways["absolute"] == pytest.approx(46.7, abs=1.0)
    assert headways["uncoupled"] == pytest.approx(24.1, abs=1.0)
