"""What the commands print with `--json`, held to the schema that stands in the documentation."""

import json
import math
import sys
from functools import cache
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from railcosim.fmus.build import package
from railcosim.orchestrator import load, run
from railcosim.orchestrator.cli import documents
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.cli.documents import Document, text_of
from railcosim.orchestrator.fmi import Variable, Workspace, load_fmu
from railcosim.orchestrator.fmi.interface import Sort
from railcosim.orchestrator.packing import Packed
from railcosim.orchestrator.packing.exposure import Exposed
from railcosim.orchestrator.study.search import Optimized
from railcosim.orchestrator.study.search.evaluations import Evaluation
from railcosim.orchestrator.study.search.optimization import Optimization
from railcosim.orchestrator.validation import Finding, Report

SCHEMA = Path(__file__).parents[4] / "docs" / "reference" / "json_schema.json"
TEXT = """
title = "A lag"
[simulation]
stop_time = 1.0
step = 0.5
[instances.lag]
component = "{lag}"
start.rate = 2.0
[events]
[metrics]
end = "final(lag.x)"
never = "settling_time(lag.x, 1e-9)"
[require]
low = "always lag.x <= 5"
[presets.fast]
"lag.rate" = 3.0
[[published]]
metric = "end"
value = 2.0
tolerance = 9.0
origin = "stated"
where = "here"
[[figures]]
title = "x"
y = ["lag.x"]
"""


@cache
def validator():
    return jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text(encoding="utf-8")))


@pytest.fixture
def scenario(tmp_path, mine, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lag.toml").write_text(TEXT.replace("[events]\n", "").format(lag=mine("Lag")))
    return "lag.toml"


@pytest.fixture
def answer(capsys):
    """Calls a command with ``--json``; its document, which the schema describes."""

    def ask(*arguments, code=0):
        capsys.readouterr()
        assert call([*map(str, arguments), "--json"]) == code
        document = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
        validator().validate(document)
        assert document["command"] == arguments[0]
        return document["result"]

    return ask


def test_looking_at_scenarios(scenario, answer):
    assert "comfort_cruise" in [each["name"] for each in answer("list")["scenarios"]]
    assert answer("check", scenario, "--trust")["order"] == ["lag"]
    told = answer("describe", scenario)
    assert (told["kind"], told["instances"][0]["start"]["rate"], list(told["presets"])) == ("scenario", 2.0, ["fast"])
    answer("check", "nothing.toml", code=2)


def test_models(scenario, answer, tmp_path):
    told = answer("describe", "Gust")
    assert told["kind"] == "model"
    assert {each["name"]: each["unit"] for each in told["variables"]}["size"] == "m/s2"
    assert answer("build", "Gust", "-o", tmp_path)["files"] == [str(tmp_path / "Gust.fmu")]
    assert answer("new", "mine.py") == {"file": "mine.py", "name": "Mine"}


def test_an_fmu_that_is_tried(answer, monkeypatch, tmp_path, capsys):
    path, *_ = package("Gust", {})
    with Workspace() as workspace:
        interface = load_fmu(path, workspace).interface
    found = (Finding("archive", "pass", "fine"), Finding("steps", "fail", "it does not"))
    monkeypatch.setattr("railcosim.orchestrator.validation.validate", lambda *_, **__: Report(path, interface, found))
    told = answer("validate", path, code=1)
    assert (told["passed"], told["findings"][1]["detail"]) == (False, "it does not")
    assert call(["validate", str(path), "-q"]) == 1
    said = capsys.readouterr().out
    assert "it does not" in said
    assert "fine" not in said


def test_a_run_its_step_its_figures_and_a_comparison(scenario, answer):
    told = answer("run", scenario, "-o", "out", "--kind", "plain", "--verify-step")
    assert told["metrics"][1]["values"] == {"": "nan"} or told["metrics"][1]["problem"] == ""
    assert [each["verdict"] for each in told["published"]] == ["reproduced"]
    assert [each["name"] for each in told["half_step"]] == ["end", "never"]
    assert told["step_check"]["verdict"] in ("fine", "too coarse")
    assert answer("plot", "out", "lag.x")["files"] == ["out/lag-x.png"]
    told = answer("compare", scenario, "--preset", "fast", "--kind", "plain", "--no-figures", "-o", "both")
    assert [each["name"] for each in told["variants"]] == ["as it stands", "fast"]
    assert told["requirements"] == {"low": ["pass", "pass"]}


def test_published_cases(answer, monkeypatch, scenario):
    monkeypatch.setattr(sys.modules["railcosim.orchestrator.scenario.shipped"], "MODELS", Path.cwd())
    told = answer("reproduce", "--kind", "plain")
    assert told["counts"] == {"stated": {"reproduced": 1}}
    assert [case["command"] for case in told["cases"]] == ["orchestrate run lag"]


def test_a_linear_model(scenario, answer):
    told = answer("linearize", scenario, "--at", 0.5, "--no-figures", "--inputs", "lag.u", "-o", "linear")
    assert told["verdict"] == "stable"
    assert told["modes"][0]["time_constant"] == pytest.approx(0.5)


def test_a_study_and_one_of_its_runs(scenario, answer):
    plain = ("--kind", "plain", "--no-figures")
    told = answer("study", scenario, "--vary", "lag.rate=1:3", "--runs", 4, "--workers", 0, "-o", "study", *plain)
    assert (told["done"], told["verdicts"]) == (4, {"low": {"pass": 4}})
    assert told["summary"]["metrics"][0]["name"] == "end"
    assert [each["output"] for each in told["sensitivities"]] != []
    told = answer("replay", "study", scenario, "--run", 2, "--no-figures")
    assert (told["differences"], told["run"]["status"]) == ([], "completed")


def test_searches(scenario, answer):
    how = ("--kind", "plain", "--no-figures", "--workers", 0, "--vary", "lag.x=0:9", "--budget", 8)
    told = answer("falsify", scenario, *how, code=1)
    assert told["found"]["found"]
    assert told["verdict"]["verdict"] == "fail"
    assert [line for line in told["changes"] if "lag.x" in line]


def test_the_best(tmp_path):
    best = Evaluation(3, {"lag.x": 1.0}, "completed", metrics={"end": 0.25})
    found = Optimization({"end": "end"}, ("low",), 0, 8, 1, (best,), (best,), ("why",))
    result = Optimized(found, tmp_path, (tmp_path / "best.toml",), (("lag.x = 1",),), ())
    document = Document("optimize", 0, None, documents.optimize_document(result))
    validator().validate(json.loads(text_of(document)))
    assert document.result.best[0].values == [0.25]


def test_one_fmu_of_a_scenario():
    speed = Variable("speed", 1, Sort("Real", "output", "continuous", None))
    packed = Packed(Path("a.fmu"), (Exposed("train[1]", speed, "output"),), ("linux64",), ("a note",))
    document = Document("pack", 0, None, documents.pack_document(packed, 10))
    validator().validate(json.loads(text_of(document)))
    assert document.result.instances == 10


def test_what_is_not_as_declared_is_refused(scenario):
    outcome = run(load(scenario), kind="plain")
    document = json.loads(text_of(Document("run", 0, None, documents.run_document(outcome))))
    validator().validate(document)
    document["result"]["stop_time"] = "soon"
    assert not validator().is_valid(document)
    document["result"]["stop_time"] = "inf"
    validator().validate(document)
    assert math.isinf(float(document["result"]["stop_time"]))
    assert np.isfinite(outcome.time).all()
