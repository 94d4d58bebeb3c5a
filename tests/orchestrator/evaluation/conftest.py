"""What the tests of evaluation share: they hold whatever the parts are in which a run is looked at."""

import pytest
from railcosim.orchestrator.evaluation import signals


@pytest.fixture(params=[signals.BLOCK, 3], ids=["whole", "parts"])
def parts(request, monkeypatch):
    """A run as one part, and in parts of three points."""
    monkeypatch.setattr(signals, "BLOCK", request.param)
