"""The emergency brake of a hundred-wagon train: what the wave in the pipe does to the couplers."""

import pytest
from railcosim.orchestrator import load, run


@pytest.mark.long
def test_the_slower_and_the_more_together_the_brakes_the_milder_the_couplers():
    found = {}
    for preset in ("p", "g", "electric"):
        result = run(load("freight_emergency", preset=preset))
        assert {check.verdict for check in result.requirements} == {"pass"}
        found[preset] = {metric.name: next(iter(metric.values.values())) for metric in result.metrics}
    compression = {preset: metrics["largest_compression"] for preset, metrics in found.items()}
    assert compression["electric"] < 1e4 < compression["g"] < 0.3 * compression["p"]
    assert found["electric"]["way"] < found["p"]["way"] < found["g"]["way"]
