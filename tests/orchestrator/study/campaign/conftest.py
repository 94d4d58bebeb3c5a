"""A small study of toys, and what its runs are when nothing disturbs it."""

import shutil
from pathlib import Path

import pytest
from railcosim.orchestrator import Study, load
from railcosim.orchestrator.study.campaign import run_study
from railcosim.orchestrator.study.design import make_plan

from ..conftest import TEXT

TOYS = Path(__file__).parents[3] / "toys.py"


def plan_of(system, *vary, runs=None):
    return make_plan(system, vary or ("lag.rate=uniform(0.1, 3)",), runs=runs, seed=3)


@pytest.fixture
def how(scenario):
    """How the runs of the small scenario are made."""
    return {"scenario": str(scenario), "kind": "plain"}


@pytest.fixture(scope="session")
def once(tmp_path_factory):
    """Six runs in this process, of random rates; nobody changes them."""
    place = tmp_path_factory.mktemp("once")
    scenario = place / "small.toml"
    scenario.write_text(TEXT.replace("{toys}", str(TOYS)), encoding="utf-8")
    how = {"scenario": str(scenario), "kind": "plain"}
    return run_study(plan_of(load(scenario), runs=6), how, place / "study", workers=0)


@pytest.fixture
def undisturbed(once, tmp_path):
    """A copy of them."""
    return Study.load(shutil.copytree(once.directory, tmp_path / "undisturbed"))


def same(one, other):
    """Whether two studies have the same runs, to the bit."""
    tables = [study.table().drop_columns(["seconds"]).replace_schema_metadata() for study in (one, other)]
    return tables[0].equals(tables[1])
