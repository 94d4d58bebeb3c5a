"""What errors say."""

import errno
import os
from pathlib import Path

import pytest
from railcosim.orchestrator.errors import naming


@pytest.mark.parametrize("known", [None, "other.csv"])
def test_an_error_of_the_system_s_names_the_file(known):
    """Those of writing to a file that is open come without its name."""
    with pytest.raises(OSError, match="No space left") as raised, naming(Path("results.bin")):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), known)
    assert raised.value.filename == (known or "results.bin")
