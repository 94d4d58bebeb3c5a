"""The digest of a file, and what is said where it cannot be read."""

import hashlib

import pytest
from railcosim.orchestrator import ScenarioError
from railcosim.orchestrator.digests import digest_of


def test_a_file_is_known_by_its_content(tmp_path):
    path = tmp_path / "x.fmu"
    path.write_bytes(b"x" * 300_000)
    assert digest_of(path) == hashlib.sha256(b"x" * 300_000).hexdigest()
    path.unlink()
    for given, error in (((), ScenarioError), ((OSError,), OSError)):
        with pytest.raises(error, match=r"x\.fmu cannot be read: No such file or directory"):
            digest_of(path, *given)
