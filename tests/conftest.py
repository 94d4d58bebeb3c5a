"""What all tests share: a cache for the FMUs that they build, components of a user's, how examples are drawn."""

import os
import sys
from collections import defaultdict
from pathlib import Path

import pytest
from hypothesis import settings

# The same examples each time, however slow the machine is. What differs all the same between a checkout and an
# installed package, and with what else was imported: the constants that are tried, which Hypothesis takes from modules.
settings.register_profile("repeatable", derandomize=True, database=None, deadline=None)
settings.load_profile("repeatable")

_LATER = {"long", "campaign"}
"""Tests of other tiers than the quick one."""
_TESTS = Path(__file__).parent
_HEAD = """from railcosim.components import Component, Data, Input, Memory, Noise, Output, Parameter, Size, State, maths


class Base(Component):
    pass


"""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Of a test with very many cases a sample is in the quick tier, spread from the first to the last, the rest in the
    long one. It is one of the cases that are collected: a single one that is asked for by its node id is quick then,
    and ``-m long`` leaves it out. What `few` keeps of tests of every model are certain models instead."""
    families = defaultdict(list)
    for item in items:
        if item.get_closest_marker("sample") and not (_LATER & {mark.name for mark in item.iter_markers()}):
            families[item.path, item.originalname].append(item)
    for family in families.values():
        (size,) = family[0].get_closest_marker("sample").args
        quick = {round(k * (len(family) - 1) / max(1, size - 1)) for k in range(min(size, len(family)))}
        for number, item in enumerate(family):
            if number not in quick:
                item.add_marker(pytest.mark.long)


@pytest.fixture(scope="session")
def session_cache(tmp_path_factory):
    """One cache for all folders and worker processes of a test session: what one has built serves the others."""
    root = tmp_path_factory.getbasetemp()
    return (root.parent if "PYTEST_XDIST_WORKER" in os.environ else root) / "cache"


_UNMEASURED = ("docs", "interop", "scenarios")
"""Folders whose tests reach no branch that those of the rooms do not: they are twice as fast unmeasured."""


@pytest.fixture(autouse=True)
def _what_is_aimed_at_counts(request):
    """No branch counts as covered because drawn examples happen to reach it: elsewhere, others are drawn."""
    measuring = "coverage" in sys.modules and sys.modules["coverage"].Coverage.current()
    chance = "explore" in request.fixturenames or hasattr(request.function, "hypothesis")
    apart = request.path.relative_to(_TESTS).parts[0] in _UNMEASURED or request.node.get_closest_marker("unmeasured")
    if not measuring or not (chance or apart):
        yield
        return
    with pytest.MonkeyPatch.context() as patch:
        for name in ("COVERAGE_PROCESS_START", "COVERAGE_PROCESS_CONFIG"):  # nor do processes that it starts
            patch.delenv(name, raising=False)
        measuring.stop()
        yield
        measuring.start()


@pytest.fixture
def components(tmp_path):
    """Write a user's component file; gives a function from class name to reference."""

    def write(body, name="mine.py"):
        (tmp_path / name).write_text(_HEAD + body, encoding="utf-8")
        return lambda cls: f"{tmp_path / name}:{cls}"

    return write
