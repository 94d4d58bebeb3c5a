"""From options and `[study]` to a plan; every message read."""

import pytest
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.scenario.loading import dump, loads
from railcosim.orchestrator.study.design import Dimension, Plan, make_plan, plan_notes

TEXT = """[simulation]
stop_time = 1.0
[instances.cruise]
component = "ComfortCruise"
"""
STUDY = """
[study]
runs = 64
seed = 7
design = "sobol"
[study.vary]
cruise.alpha = "0.005:0.05"
"cruise.beta" = [0.1, 0.2]
simulation.seed = "integers(1, 9)"
"""


def plan(text=TEXT, vary=(), **options):
    return make_plan(loads(text, "x.toml"), vary, **options)


def problems(text=TEXT, vary=(), **options):
    with pytest.raises(ScenarioError) as caught:
        plan(text, vary, **options)
    return [str(problem) for problem in caught.value.problems]


def test_options():
    one = (Dimension.parse("cruise.alpha=1:3:3"),)
    two = (*one, Dimension.parse("cruise=A,B"))
    assert plan(vary=["cruise.alpha=1:3:3"]) == Plan(one, "grid", 3, 0)
    assert plan(vary=["cruise.alpha=1:3:3", "cruise=A,B"], design="grid") == Plan(two, "grid", 6, 0)
    assert plan(vary=["cruise.alpha=1:3:3"], runs=10, seed=4) == Plan(one, "random", 10, 4)
    assert plan(vary=["cruise.alpha=1:3:3"], runs=10, design="latin-hypercube") == Plan(one, "latin-hypercube", 10)
    assert plan(runs=5) == Plan((), "random", 5, 0)


def test_the_section_of_a_scenario():
    made = plan(TEXT + STUDY)
    names = ["cruise.alpha", "cruise.beta", "simulation.seed"]
    assert (made.names, made.design, made.count, made.seed) == (names, "sobol", 64, 7)
    assert plan(TEXT + STUDY, runs=15, seed=0, design="saltelli") == Plan(made.dimensions, "saltelli", 15, 0)
    assert plan(TEXT + STUDY, ["cruise.alpha=1,2"]) == Plan((Dimension.parse("cruise.alpha=1,2"),), "grid", 2, 0)
    again = loads(dump(loads(TEXT + STUDY)))
    assert again == loads(TEXT + STUDY)
    assert make_plan(again) == made
    assert not loads(TEXT + STUDY).provenance.modified


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "nothing is varied; give --vary cruise.alpha=0.005:0.05:10, or write [study.vary] into the scenario"),
        ({"vary": ["a.x=1:2"]}, "--vary a.x=1:2: a distribution has no grid; give --runs 1000"),
        ({"vary": ["a.x=1,2"], "runs": 0}, "--runs: takes a whole number of runs, at least 1, not 0"),
        ({"vary": ["a.x=1,2"], "seed": -1}, "--seed: takes a whole number from 0 to 2**63 - 1, not -1"),
        ({"vary": ["a.x=1,2"], "design": "sobl"}, "--design: there is no design 'sobl'; did you mean 'sobol'?"),
        ({"vary": ["a.x=1,2"], "design": "x"}, "--design: there is no design 'x'; there are grid, random, latin-"),
        ({"vary": ["a.x=1,2"], "design": "sobol"}, "--design: 'sobol' needs a number of runs; give --runs 1000"),
        (
            {"vary": ["a.x=1,2"], "design": "grid", "runs": 9},
            "--runs: a grid has as many runs as it has points, 2; leave runs out, or take --design random",
        ),
        ({"design": "sobol", "runs": 9}, "--design: 'sobol' has nothing to vary; give --vary, or take 'random'"),
        (
            {"vary": ["a.x=1:2", "a.y=1:2"], "design": "saltelli", "runs": 100_0 + 1},
            "--runs: 'saltelli' takes blocks of 4 runs, not 1001 runs; take 512 or 1024",
        ),
        (
            {"vary": ["a.x=1:2"], "design": "saltelli", "runs": 3},
            "--runs: 'saltelli' takes two blocks or more of 3 runs, not 3 runs; take 6 or 12",
        ),
        (
            {"vary": ["a.x=1,2", "a.x=3"]},
            "--vary a.x=3: 'a.x' is varied twice; also by --vary a.x=1,2",
        ),
    ],
)
def test_what_is_said_about_options(options, message):
    (found,) = problems(**options)
    assert found.startswith(message)


def test_every_wrong_option_is_told():
    assert len(problems(vary=["a", "a.x=1:y"], runs=0)) == 3


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("runs = 64", "runs = 1.5", "x.toml:7: study.runs: takes a whole number of runs, at least 1, not 1.5"),
        ("seed = 7", "seed = -1", "x.toml:8: study.seed: takes a whole number from 0 to 2**63 - 1, not -1"),
        ('"sobol"', '"sobl"', "x.toml:9: study.design: there is no design 'sobl'; did you mean 'sobol'?"),
        ('"sobol"', "3", "x.toml:9: study.design: there is no design '3'; there are"),
        ("runs =", "run =", "x.toml:7: study.run: unknown key 'run'; did you mean 'runs'?"),
        ("runs = 64", "", "x.toml:9: study.design: 'sobol' needs a number of runs; give --runs 1000"),
        ('"0.005:0.05"', '"1:x"', "x.toml:11: study.vary.cruise.alpha: 'x' is no number; write low:high:count"),
        ("[0.1, 0.2]", "[]", 'x.toml:12: study.vary."cruise.beta": takes no empty list'),
        ("[0.1, 0.2]", "2020-01-01", 'x.toml:12: study.vary."cruise.beta": takes a text, a number, or a list of val'),
        ("[0.1, 0.2]", "[{ a = 1 }]", 'x.toml:12: study.vary."cruise.beta": takes a text, a number, or a list of va'),
        ("[study.vary]", "[study.wary]", "x.toml:10: study.wary: unknown key 'wary'; did you mean 'vary'?"),
    ],
)
def test_what_is_said_about_the_section(old, new, message):
    (found, *_) = problems(TEXT + STUDY.replace(old, new))
    assert found.startswith(message)


def test_what_is_no_table():
    assert problems("study = 3\n" + TEXT) == ["x.toml:1: study: is a table, [study], not 3"]
    assert problems(TEXT + "[study]\nvary = 3\n") == ["x.toml:6: study.vary: is a table, [study.vary], not 3"]


@pytest.mark.parametrize(
    ("design", "runs", "note"),
    [
        ("random", 100, []),
        ("sobol", 128, []),
        (
            "sobol",
            100,
            ["a Sobol sequence is balanced for a number of points that is a power of 2: 64 or 128, not 100"],
        ),
        ("saltelli", 3 * 16, []),
        (
            "saltelli",
            3 * 10,
            ["a Sobol sequence is balanced for a number of blocks that is a power of 2: 8 or 16, not 10"],
        ),
    ],
)
def test_what_is_told_beforehand(design, runs, note):
    assert plan_notes(plan(vary=["a.x=1:2"], runs=runs, design=design)) == note
