"""The page of a study as a file."""

import html
import json
import re

import pytest
from railcosim.orchestrator.cli import app as cli
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.report import write_report
from railcosim.orchestrator.report.studies import table


def read(path):
    text = path.read_text(encoding="utf-8")
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    return text, json.loads(found[1])["study"]


def test_a_study(study, monkeypatch):
    path = write_report([study()])
    text, data = read(path)
    assert path.name == "report.html"
    assert "<b>$$" not in text
    assert html.escape("Lags <b>$$x$$</b>") in text
    assert "6 of 6 runs, completed" in text
    assert "What matters for margin.&lt;i&gt;low" in text
    assert '<button type="button" data-number="' in text
    assert (data["count"], data["errors"], data["best"]) == (6, {}, [])
    assert len(data["axes"]) == 2
    assert set(data["axes"]) == {"lag.u", "lag.x"}
    assert set(data["series"]["runs"]) == {str(k) for k in range(6)}
    monkeypatch.setattr(table, "_MOST_NUMBERS", 1)
    assert "The first 1 of 6 runs are shown" in write_report([path.parent]).read_text(encoding="utf-8")


def test_a_study_without_requirements(mine, tmp_path):
    """What is broken is told, and what nothing is known of."""
    path = tmp_path / "bare.toml"
    path.write_text(f'[simulation]\nstop_time = 1.0\n[instances.lag]\ncomponent = "{mine("Fails")}"\n')
    bare = tmp_path / "bare"
    words = ["study", str(path), "--vary", "lag.until=0.5,2.0", "--kind", "plain", "--workers", "0", "--no-figures"]
    assert cli.call([*words, "-o", str(bare), "-q", "--report"]) == 3
    text, data = read(bare / "report.html")
    assert list(data["errors"]) == ["0"]
    assert "1 failed" in text
    assert data["axes"] == ["lag.until", "run"]


def test_a_search(search):
    best = [{"run": 1, "scenario": "best.toml", "values": [1.0]}]
    directory = search(minimize=["end"], best=best, runs=3)
    text, data = read(write_report([directory]))
    assert "What was found" in text
    assert (data["axes"], data["best"], data["errors"]) == (["run", "metric.end"], [1], {"2": "it <fails>"})
    assert len(data["commands"]) == 3


def test_one_study_a_page(study, search):
    with pytest.raises(ScenarioError, match="is a study or a search, of which a page shows one alone"):
        write_report([study(), search()])
    with pytest.raises(ScenarioError, match="a live page has the models of one run"):
        write_report([search()], live=True)


def test_a_study_makes_its_page(study, tmp_path, capsys):
    study(runs=2)
    directory = tmp_path / "made"
    words = ["study", str(tmp_path / "lags.toml"), "--runs", "2", "--kind", "plain", "--workers", "0", "--no-figures"]
    assert cli.call([*words, "-o", str(directory), "--report"]) == 1, capsys.readouterr().err
    assert f"Report: {directory / 'report.html'}" in capsys.readouterr().out
    again = tmp_path / "again"
    assert cli.call([*words, "-o", str(again), "--report", "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["result"]["report"] == str(again / "report.html")
