"""A live page out of a run's directory: the run's own models, or a message that says all that is in the way."""

import base64
import json
import re
import zlib

import pytest
from railcosim.fmus import toolchain
from railcosim.fmus.toolchain import CompilerError
from railcosim.orchestrator import System, run
from railcosim.orchestrator.cli import app as cli
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.report import write_report
from railcosim.orchestrator.report.live import make_live


@pytest.fixture
def switched(mine, tmp_path):
    """The directory of a run with a truth value among its start values."""
    system = System(stop_time=1.0, step=0.1)
    system.add("wave", mine("Wave"))
    system.add("switch", mine("Switch"), on=True)
    system.connect("wave.y", "switch.w")
    run(system, kind="native", output=tmp_path / "switched", figures=False)
    return tmp_path / "switched"


def test_the_run_as_it_was(switched, compiled, mine):
    live = make_live(switched, trust=True)
    assert compiled == [(mine(name), {}, "native", ["wasm"]) for name in ("Wave", "Switch")]
    unpacked = [zlib.decompress(base64.b64decode(text), wbits=-15).decode() for text in live.modules]
    assert unpacked == ["module of Wave", "module of Switch"]
    wave, switch = live.data["plan"]["instances"]
    assert (wave["module"], switch["module"]) == (0, 1)
    record = json.loads((switched / "run.json").read_text())
    assert switch["guid"] == record["instances"]["switch"]["guid"]
    assert [start["values"] for start in switch["starts"]] == [[1.0]]
    assert live.data["parameters"]["switch.high"] == 10.0


def test_instances_of_one_model_share_its_module(directory, compiled):
    live = make_live(directory, trust=True)
    assert [each["module"] for each in live.data["plan"]["instances"]] == [0, 1, 1]
    assert len(live.modules) == 2


def test_a_page_with_models(directory, compiled):
    plain = write_report([directory]).read_text(encoding="utf-8")
    text = write_report([directory], live=True, trust=True).read_text(encoding="utf-8")
    policy, strict = (re.search(r'content="(default-src[^"]*)"', each)[1] for each in (text, plain))
    assert "script-src 'unsafe-inline' 'wasm-unsafe-eval'; worker-src blob:;" in policy
    assert "wasm" not in strict
    assert text.count("data-module") == 2 + 1, "two modules, and what looks for them"
    assert 'id="live"' not in plain
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL)[1])
    lines = [line for panel in data["panels"] for line in panel["lines"]]
    assert lines[0]["track"] == ["signal", "lag[1].x"]
    assert lines[3]["track"] == ["-", ["signal", "lag[1].x"], ["signal", "wave.y"]]
    assert not [
        line
        for line in json.loads(re.search(r'id="data">(.*?)</script>', plain, re.DOTALL)[1])["panels"][0]["lines"]
        if "track" in line
    ]


def test_what_follows_comes_first(directory, compiled):
    path, function = directory / "run.json", {"title": "alone", "x": {"name": "d", "from": 0, "to": 1}, "y": "d"}
    record = json.loads(path.read_text())
    path.write_text(json.dumps(record | {"figures_wanted": [function, *record["figures_wanted"]]}))
    for live in (False, True):
        text = write_report([directory], live=live, trust=live).read_text(encoding="utf-8")
        panels = json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL)[1])["panels"]
        assert panels[-1 if live else 0]["title"] == "alone"


def test_several_runs_have_no_live_page(directory):
    with pytest.raises(ScenarioError, match="the models of one run"):
        write_report([directory, directory], live=True)


def test_code_is_not_executed_without_being_asked(directory, mine, odd, tmp_path):
    with pytest.raises(ScenarioError, match="--trust imports it"):
        make_live(directory)
    system = System(stop_time=1.0, step=0.1)
    system.add("odd", odd)
    run(system, output=tmp_path / "odd", figures=False)
    with pytest.raises(ScenarioError, match=r"odd: .*odd\.fmu would be loaded.*--trust loads it"):
        make_live(tmp_path / "odd")
    with pytest.raises(ScenarioError, match=r"odd: .*odd\.fmu has no binaries/wasm32-wasi/Odd\.wasm"):
        make_live(tmp_path / "odd", trust=True)


def test_everything_in_the_way_is_said_at_once(wavy, tmp_path):
    system = wavy(stop_time=1.0)
    run(system, kind="plain", output=tmp_path / "plain", figures=False)
    path = tmp_path / "plain" / "run.json"
    path.write_text(path.read_text().replace('"completed"', '"failed"'))
    with pytest.raises(ScenarioError) as caught:
        make_live(tmp_path / "plain")
    assert "the run is failed" in str(caught.value)
    assert "wave: it runs as a plain model, which a browser cannot" in str(caught.value)


def test_other_models_than_those_of_the_run(directory):
    path = directory / "run.json"
    guid = json.loads(path.read_text())["instances"]["wave"]["guid"]
    path.write_text(path.read_text().replace(guid, "{other}"))
    with pytest.raises(ScenarioError, match="wave: its model is no longer the one of the run"):
        make_live(directory, trust=True)


def test_without_the_compiler(directory, monkeypatch):
    monkeypatch.setattr(toolchain, "has_zig", lambda: False)
    with pytest.raises(CompilerError, match=r"no C compiler for wasm: 'pip install railcosim\[cross\]'"):
        make_live(directory, trust=True)


SCENARIO = """
[simulation]
stop_time = 1.0
step = 0.1
[instances.lag]
component = "{lag}"
"""


@pytest.fixture
def scenario(mine, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "small.toml"
    path.write_text(SCENARIO.format(lag=mine("Lag")))
    return path


def test_with_a_run(scenario, compiled, capsys):
    assert cli.call(["run", str(scenario), "--report", "--live", "--no-figures", "-o", "out"]) == 0
    assert 'id="live"' in (scenario.parent / "out" / "report.html").read_text(encoding="utf-8")
    assert cli.call(["report", "out", "--live", "--trust"]) == 0


def test_a_page_whose_run_fails_is_a_page_without_models(scenario, mine, compiled, capsys):
    """The run is told, and the exit code is its own; what could not be live at all does not begin."""
    scenario.write_text(SCENARIO.format(lag=mine("Fails")) + "start.until = 0.5\n")
    assert cli.call(["report", str(scenario), "--live", "--trust"]) == 3
    page = scenario.parent / "results" / "small" / "report.html"
    assert 'id="live"' not in page.read_text(encoding="utf-8")
    page.unlink()
    scenario.write_text(SCENARIO.format(lag=mine("Lag")).replace("step = 0.1", 'step = 0.1\nalgorithm = "iterative"'))
    assert cli.call(["report", str(scenario), "--live", "--trust"]) == 2
    assert not page.exists()


def test_a_run_that_could_not_be_live_does_not_begin(scenario, capsys):
    assert cli.call(["run", str(scenario), "--live", "-o", "out"]) == 2
    assert "give both" in capsys.readouterr().err
    for change in (["--kind", "plain"], ["--algorithm", "iterative"]):
        assert cli.call(["run", str(scenario), "--report", "--live", *change, "-o", "out"]) == 2
        assert "live page" in (said := capsys.readouterr().err) or "browser" in said
    assert not (scenario.parent / "out").exists()
