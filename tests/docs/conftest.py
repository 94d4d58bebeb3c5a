"""The site's generator is no package: it is imported from its folder, as mkdocs does."""

import importlib
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="session")
def component_page():
    """The module that makes component pages."""
    sys.path.insert(0, str(FOLDER))
    try:
        return importlib.import_module("component_page")
    finally:
        sys.path.remove(str(FOLDER))
