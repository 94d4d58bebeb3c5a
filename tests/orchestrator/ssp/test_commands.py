"""SSPs as the commands and `load` take them: what options change, what is told, and a run of known numbers."""

import json

import pandas
import pytest
from railcosim.fmus.build import build
from railcosim.orchestrator import Results, ScenarioError, load, run
from railcosim.orchestrator.cli.app import call

from .conftest import binding, bindings, component, connection, connectors, packed, parameters, real, structure, system


@pytest.fixture
def passing(mine, tmp_path):
    """y = 3 u + 1 of the root's input u = 2, and z = 2 y + 10 behind it: 7 and 24."""
    shown = connectors(u="input", y="output", gain="parameter", bias="parameter")
    own = bindings(binding(parameters(("gain", real(3)), ("bias", real(1)))))
    parts = component("first", own, source="resources/pass.fmu", shown=shown)
    inner = system(
        component("second", source="resources/pass.fmu", shown=shown),
        connection("i", "second.u", '<ssc:LinearTransformation factor="2" offset="10"/>'),
        connectors(i="input"),
        name="inner",
    )
    wires = connection("u", "first.u") + connection("inner.i", "first.y")
    bound = bindings(binding(parameters(("u", real(2)))))
    top = structure(
        system(parts + inner, wires, connectors(u="input"), bound),
        '<ssd:DefaultExperiment startTime="0" stopTime="1"/>',
    )
    other = top.replace('value="2"', 'value="4"')
    fmu = build(mine("Pass"), kind="native").read_bytes()
    path = tmp_path / "system.ssp"
    path.write_bytes(packed({"SystemStructure.ssd": top, "Four.ssd": other, "resources/pass.fmu": fmu}))
    return str(path)


def test_a_run_of_known_numbers(passing):
    result = run(load(passing))
    assert result.status == "completed"
    assert set(result["first.y"]) == {7.0}
    assert set(result["inner_second.y"]) == {24.0}
    changed = run(load(f"{passing}#Four", settings=["first.gain=1"], stop_time=0.5, step=0.25))
    assert list(changed.time) == [0.0, 0.25, 0.5]
    assert set(changed["first.y"]) == {5.0}
    options = ("--set", "first.gain=1", "--step", "0.25", "--stop", "0.5")
    assert changed.system.provenance.command == (f"{passing}#Four", *options)


def test_what_is_wrong_is_told_where_it_stands(archive):
    wrong = bindings(binding(parameters(("n", real(1.5)))))
    path = archive(structure(system(component("a", wrong))))
    system_ = load(path)
    assert system_.provenance.origins["a.n"].endswith("system.ssp/SystemStructure.ssd:4")
    assert system_.instances["a"].origin.endswith("system.ssp/SystemStructure.ssd:4")
    with pytest.raises(ScenarioError, match=r"system\.ssp: there is no preset 'x'"):
        load(path, preset="x")


def test_the_commands(passing, tmp_path, capsys):
    assert call(["check", passing]) == 0
    told = capsys.readouterr().out
    assert "names of instances: inner.second is inner_second" in told
    assert call(["describe", passing]) == 0
    assert "inner_second.u" in capsys.readouterr().out
    assert call(["run", passing, "-o", str(tmp_path / "out"), "--quiet", "--no-figures"]) == 0
    assert (tmp_path / "out" / "run.json").is_file()
    assert call(["check", f"{passing}#None"]) == 2


def test_a_variant_by_option(passing, tmp_path, capsys, monkeypatch):
    """y = 3 u + 1 = 13 for its u = 4; its results stand beside those of the default, not in their place."""
    monkeypatch.chdir(tmp_path)
    assert call(["describe", passing, "--variant", "Four", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["result"]["instances"][0]["start"]["u"] == 4.0
    assert call(["check", passing, "--variant", "Four.ssd", "--quiet"]) == 0
    assert call(["run", passing, "--variant", "Four", "--quiet", "--no-figures"]) == 0
    assert set(Results.load(tmp_path / "results" / "system-Four")["first.y"]) == {13.0}
    capsys.readouterr()
    for words, said in (
        ([passing, "--variant", "Fuor"], "no variant 'Fuor'; there are SystemStructure (root), Four (root)"),
        ([f"{passing}#Four", "--variant", "Four"], "names a variant already"),
        (["comfort_cruise", "--variant", "Four"], "comfort_cruise is no .ssp, and has no variants"),
    ):
        assert call(["check", *words]) == 2
        assert said in " ".join(capsys.readouterr().err.split())
    assert call(["describe", "PointMassTrain", "--variant", "Four"]) == 2
    assert call(["run", "--resume", str(tmp_path / "results" / "system-Four"), "--variant", "Four"]) == 2


def test_a_study_of_a_variant(passing, tmp_path, capsys, monkeypatch):
    """It runs the variant, not the default; it is not gone on with as a study of another one."""
    monkeypatch.chdir(tmp_path)
    words = ["study", "system.ssp", "--vary", "first.gain=1,2", "--record", "first.y", "--workers", "0", "-q"]
    assert call([*words, "--variant", "Four", "--no-figures"]) == 0
    series = pandas.read_parquet(tmp_path / "results" / "system-Four-study" / "series.parquet")
    assert set(series["first.y"]) == {5.0, 9.0}  # u = 4, and not 2
    assert call([*words, "-o", "results/system-Four-study", "--no-figures", "--resume"]) == 2
    assert "another study: the options differs" in " ".join(capsys.readouterr().err.split())


def test_an_archive_without_a_default_asks_for_a_variant(archive, capsys):
    top = structure(system(component("a")))
    path = archive({"A.ssd": top, "B.ssd": top.replace('name="root" version', 'name="B" version'), "C.ssd": "no XML"})
    assert call(["check", path]) == 2
    told = " ".join(capsys.readouterr().err.split())
    assert "no SystemStructure.ssd at its top but others; choose a variant by --variant: A (root), B, C" in told
    assert load(f"{path}#B").provenance.name == "system-B"


def test_a_page_of_an_archive(passing, tmp_path, capsys, monkeypatch):
    """It is run first, like any scenario; a directory of the same name is one of results."""
    monkeypatch.chdir(tmp_path)
    assert call(["report", passing, "--quiet"]) == 0
    assert (tmp_path / "results" / "system" / "report.html").is_file()
    assert call(["report", passing, str(tmp_path / "results" / "system"), "--variant", "Four", "-o", "both.html"]) == 0
    assert capsys.readouterr().out.endswith("both.html\n")
    assert "system-Four" in (tmp_path / "both.html").read_text(encoding="utf-8")
    assert call(["report", str(tmp_path / "results" / "system"), "--variant", "Four"]) == 2
    assert "is of an .ssp that is to be run" in capsys.readouterr().err
    (tmp_path / "plain.toml").write_text('[simulation]\nstop_time = 1.0\n[instances.target]\ncomponent = "Schedule"\n')
    assert call(["report", passing, "plain.toml", "--variant", "Four", "-o", "two.html", "-q"]) == 0


def test_a_scenario_of_an_archive(passing, tmp_path, capsys):
    """It loads to what the archive does, FMUs from beside it; another variant by its name."""
    target = tmp_path / "new" / "made.toml"
    assert call(["import", passing, "-o", str(target)]) == 0
    assert capsys.readouterr().out == f"{target}\n"
    made, read = load(target), load(passing)
    assert target.read_text(encoding="utf-8").startswith(f"# imported from {passing}\n# ")
    fmu = tmp_path / "new" / "made_fmus" / "resources" / "pass.fmu"
    assert {one.model for one in made.instances.values()} == {str(fmu)}
    assert made.connections == read.connections
    assert made.stepping == read.stepping
    assert [one.start for one in made.instances.values()] == [one.start for one in read.instances.values()]
    assert call(["import", passing, "-o", str(target), "--variant", "Four", "--quiet"]) == 0
    assert load(target).instances["first"].start["u"] == 4.0
