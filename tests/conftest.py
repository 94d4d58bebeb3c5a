"""What all tests share: a cache for the FMUs that they build."""

import os

import pytest


@pytest.fixture(scope="session")
def session_cache(tmp_path_factory):
    """One cache for all folders and worker processes of a test session: what one has built serves the others."""
    root = tmp_path_factory.getbasetemp()
    return (root.parent if "PYTEST_XDIST_WORKER" in os.environ else root) / "cache"
