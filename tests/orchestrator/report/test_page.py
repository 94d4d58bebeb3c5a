"""The page as a file: whole, self-contained, and without a word of a user's that is taken for markup."""

import html.parser
import json
import re
from types import SimpleNamespace

import pytest
from railcosim.orchestrator import run, world
from railcosim.orchestrator.cli import app as cli
from railcosim.orchestrator.cli import printing, reports
from railcosim.orchestrator.comparison.variants import compare
from railcosim.orchestrator.errors import RailcosimError, ScenarioError
from railcosim.orchestrator.report import document, write_report


class Read(html.parser.HTMLParser):
    """What a browser would see: elements, attributes, texts outside of scripts."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.texts, self.scripts, self._in = [], [], {}, None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        self._in = tag if tag in ("script", "style") else None
        self._id = dict(attrs).get("id")

    def handle_endtag(self, tag):
        self._in = None

    def handle_data(self, data):
        if self._in is None:
            self.texts.append(data)
        elif self._id:
            self.scripts[self._id] = data


def test_a_page(directory, title):
    path = write_report([directory])
    assert path == directory / "report.html"
    text = path.read_text(encoding="utf-8")
    seen = Read(text)
    assert title in seen.texts
    assert not [attrs for tag, attrs in seen.elements if tag == "img"]
    assert not [attrs for tag, attrs in seen.elements if {"src", "onerror"} & attrs.keys()]
    assert {attrs["href"][0] for tag, attrs in seen.elements if "href" in attrs} == {"#"}
    policy = next(attrs["content"] for tag, attrs in seen.elements if "http-equiv" in attrs)
    assert policy.startswith("default-src 'none'")
    data = json.loads(seen.scripts["data"])
    assert len(data["signals"]) == 3
    assert all(seen.scripts[f"column-{k}"] for k in range(len(data["columns"])))
    assert "cdn.jsdelivr" not in text
    assert "maps.googleapis" not in text


def test_words_of_a_page(directory):
    text = " ".join(Read(write_report([directory]).read_text(encoding="utf-8")).texts)
    for said in (
        "✓ pass",
        "✗ fail",
        "always lag[i].x < 0.5",
        "peak[2]",
        "3 instances, 2 connections",
        "single precision",
    ):
        assert said in text


def test_several_runs(wavy, directory, tmp_path):
    run(wavy(stop_time=10.0), kind="native", output=tmp_path / "other", figures=False)
    path = write_report([directory, tmp_path / "other"], tmp_path / "both.html")
    seen = Read(path.read_text(encoding="utf-8"))
    assert path == tmp_path / "both.html"
    heads = [attrs["data-run"] for tag, attrs in seen.elements if "data-run" in attrs]
    assert heads == ["0", "0", "1", "1"]
    assert str(directory) in seen.texts  # both are of the same scenario


def test_a_page_of_a_failed_run_says_so(wavy, mine, tmp_path):
    system = wavy()
    system.add("fails", mine("Fails"), until=5.0)
    with pytest.raises(Exception, match="fails"):
        run(system, kind="native", output=tmp_path / "run", figures=False)
    text = " ".join(Read(write_report([tmp_path / "run"]).read_text(encoding="utf-8")).texts)
    assert "failed" in text
    assert re.search(r"fails, t = 5", text)


def test_without_the_library(directory, monkeypatch):
    monkeypatch.setattr(document.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(RailcosimError, match=r"pip install 'railcosim\[report\]'"):
        write_report([directory])


def test_no_room(directory, monkeypatch):
    def full(path, *_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(world, "write_text", full)
    with pytest.raises(RailcosimError, match=r"report\.html cannot be written: No space left on device"):
        write_report([directory])


def test_the_command(directory, capsys):
    assert cli.call(["report", str(directory / "run.json")]) == 0
    assert capsys.readouterr().out == f"{directory / 'report.html'}\n"
    assert cli.call(["report", str(directory.parent)]) == 2
    assert "holds no run that can be read" in capsys.readouterr().err


SCENARIO = """[simulation]
stop_time = 1.0
[instances.lag]
component = "{model}"
start.u = 1.0
[presets.far]
"lag.u" = 2.0
"""


def test_runs_and_comparisons_make_pages(mine, tmp_path, capsys):
    scenario, out = tmp_path / "lag.toml", tmp_path / "out"
    scenario.write_text(SCENARIO.format(model=mine("Lag")))
    assert cli.call(["run", str(scenario), "--report", "-o", str(out)]) == 0
    assert f"Report: {out / 'report.html'}" in capsys.readouterr().out
    assert cli.call(["run", str(scenario), "--report", "-o", str(out), "-q"]) == 0
    assert capsys.readouterr().out == ""
    assert cli.call(["compare", str(scenario), "--preset", "far", "--report", "-o", str(out), "--no-figures"]) == 0
    texts = Read((out / "report.html").read_text(encoding="utf-8")).texts
    assert {"lag", "lag far"} & set(texts)


def test_what_a_page_cannot_be_made_of_is_told_before_anything_runs(mine, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "lag.toml").write_text(SCENARIO.format(model=mine("Lag")))
    for words, said in (
        (["a/lag.toml", "b/lag.toml"], "a/lag.toml and b/lag.toml would both have their results in results/lag"),
        (["a/lag.toml", "b", "--live"], "a live page has the models of one run"),
        (["comfort_cruis"], "there is no directory and no scenario 'comfort_cruis'; did you mean 'comfort_cruise'?"),
    ):
        assert cli.call(["report", *words, "--trust"]) == 2
        assert said in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "results").exists()


def test_a_run_is_shown_that_has_no_page(mine, tmp_path, capsys, monkeypatch):
    """One that is interrupted is the last, and one whose page cannot be written is told first."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lag.toml").write_text(SCENARIO.format(model=mine("Lag")))
    (tmp_path / "more.toml").write_text(SCENARIO.format(model=mine("Lag")))
    assert cli.call(["report", "lag.toml", "-o", "none/there.html", "--trust"]) != 0
    said = capsys.readouterr()
    assert "results/lag" in said.out
    assert "there.html cannot be written" in " ".join(said.err.split())
    outcome = SimpleNamespace(status="interrupted", signal=2, failed=False)
    ran, shown = [], []
    monkeypatch.setattr(reports, "_run", lambda system, _: (ran.append(system.provenance.name), outcome)[1])
    monkeypatch.setattr(printing, "show_run", lambda each, *_: shown.append(each))
    assert cli.call(["report", "lag.toml", "more.toml", "--trust"]) == 130
    assert (ran, shown) == (["lag"], [outcome])


def test_a_comparison_that_was_made_before(wavy, mine, tmp_path, capsys):
    """Its directory alone: each variant has its own name; one that has left nothing is not shown."""
    fails = wavy()
    fails.add("fails", mine("Fails"), until=5.0)
    compare({"slow": wavy(), "quick": wavy(stop_time=10.0), "fails": fails}, output=tmp_path, figures=False)
    assert cli.call(["report", str(tmp_path)]) == 0
    seen = Read((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert [run["name"] for run in json.loads(seen.scripts["data"])["runs"]] == ["slow", "quick", "fails"]
    path = tmp_path / "compare.json"
    told = json.loads(path.read_text())
    for variant, results in zip(told["variants"], ("../elsewhere", None, "missing"), strict=True):
        variant["results"] = results
    path.write_text(json.dumps(told))
    with pytest.raises(ScenarioError, match="no variant that was compared has left results"):
        write_report([tmp_path])
    path.write_text("[]")
    with pytest.raises(ScenarioError, match="holds no comparison that can be read"):
        write_report([tmp_path])


def test_how_a_run_came_about(directory):
    """Of one that went on from a checkpoint, of one that has not ended, and of one without a command."""
    path = directory / "run.json"
    record = json.loads(path.read_text())
    for changes, said in (
        ({"resumed": 12.5}, "gone on from its checkpoint at 12.5 s"),
        ({"status": "running"}, "It had not ended when this page was made"),
        ({"command": None}, "no command is known"),
        ({"command": "orchestrate run 'a <b>.toml' --set 'x.y=[1, 2]'"}, "run 'a <b>.toml' --set 'x.y=[1, 2]'"),
        ({"events": [{"signal": "<i>", "action": "set", "at": 3.0, "duration": None, "every": None}]}, "set <i>"),
    ):
        path.write_text(json.dumps(record | changes))
        assert said in " ".join(Read(write_report([directory]).read_text(encoding="utf-8")).texts)
