"""What all tests share: a cache for the FMUs that they build, components of a user's."""

import os

import pytest

_HEAD = """from railcosim.components import Component, Data, Input, Memory, Noise, Output, Parameter, Size, State, maths


class Base(Component):
    pass


"""


@pytest.fixture(scope="session")
def session_cache(tmp_path_factory):
    """One cache for all folders and worker processes of a test session: what one has built serves the others."""
    root = tmp_path_factory.getbasetemp()
    return (root.parent if "PYTEST_XDIST_WORKER" in os.environ else root) / "cache"


@pytest.fixture
def components(tmp_path):
    """Write a user's component file; gives a function from class name to reference."""

    def write(body, name="mine.py"):
        (tmp_path / name).write_text(_HEAD + body, encoding="utf-8")
        return lambda cls: f"{tmp_path / name}:{cls}"

    return write
