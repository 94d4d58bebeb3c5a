"""The site's generator is no package: it is imported from its folder, as mkdocs does."""

import importlib
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "docs"


def _module(name):
    sys.path.insert(0, str(FOLDER))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(FOLDER))


@pytest.fixture(scope="session")
def component_page():
    """The module that makes component pages."""
    return _module("component_page")


@pytest.fixture(scope="session")
def json_page():
    """The module that makes the page of what `--json` prints."""
    return _module("json_page")
