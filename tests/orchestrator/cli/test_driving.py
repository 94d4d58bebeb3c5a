"""`orchestrate drive`: what is printed, and what is written."""

import csv
import json
import sys

import pytest
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.cli.completing import cases

CASE = """
[drive]
minimize = "time"
intervals = 10
tolerance = 0.1
start_speed = 5.0
end_speed = 5.0
line = { sections = [{ position = 0.0 }], stops = [{ position = 0.0 }, { position = 600.0 }] }
[drive.train]
mass = 1e5
resistance = { a = 500.0, b = 0.0, c = 0.0 }
traction = { force = 5e4, power = 1e6 }
regenerative_brake = { force = 5e4, power = 1e6 }
friction_brake = 0.0
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dash.toml").write_text(CASE)
    return tmp_path


def test_a_driving_is_told_and_written(folder, capfd):
    assert call(["drive", "dash.toml"]) == 0
    out, err = capfd.readouterr()
    assert err == ""
    title, found, meshes, errors, place = out.splitlines()
    assert title == "dash"
    assert found.startswith("least time: ")
    # 0.495 m/s2 up over w and 0.505 m/s2 down over the rest, w = 303 m: v^2 = 25 + 2 * 0.495 * 303
    top = (25.0 + 2.0 * 0.495 * 303.0) ** 0.5
    least = (top - 5.0) / 0.495 + (top - 5.0) / 0.505
    assert float(found.split()[-2]) == pytest.approx(least, abs=0.06)
    assert meshes.startswith("meshes of ")
    assert "the last of which changed it by" in meshes
    assert errors.startswith("errors: ")
    assert place == "Profile: results/dash-drive/profile.csv"
    with (folder / "results" / "dash-drive" / "profile.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert float(rows[-1]["time"]) == pytest.approx(least, abs=0.06)


def test_a_document_and_nothing_else(folder, capfd):
    assert call(["drive", "dash.toml", "--minimize", "energy", "--time", "60", "--json", "-o", "out"]) == 0
    out, err = capfd.readouterr()
    result = json.loads(out)["result"]
    assert err == ""
    assert (result["minimize"], result["case"], result["profile"]) == ("energy", "dash", "out/profile.csv")
    assert result["time_s"] <= 60.0 + 1e-4
    assert result["energy_kwh"] == pytest.approx(500.0 * 600.0 / 3.6e6, rel=1e-4)  # the rest is given back, at no loss
    assert set(result["errors"]) == {"feasibility", "optimality", "mesh", "objective"}


def test_quietly_and_of_one_mesh(folder, capfd):
    arguments = ["--minimize", "energy", "--time", "119.9", "--set", "tolerance=0.1"]
    assert call(["drive", "dash.toml", *arguments, "--quiet"]) == 0
    assert len(capfd.readouterr().out.splitlines()) == 1


def test_too_little_time(folder, capfd):
    assert call(["drive", "dash.toml", "--minimize", "energy", "--time", "20"]) == 2
    assert "error: dash: 20 s are too short: the least running time is " in capfd.readouterr().err


def test_it_needs_casadi(folder, capfd, monkeypatch):
    for name in [name for name in sys.modules if name.startswith("railcosim.orchestrator.driving.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "casadi", None)
    monkeypatch.delattr(sys.modules["railcosim.orchestrator.driving"], "optimise", raising=False)
    assert call(["drive", "dash.toml"]) == 2
    assert "driving needs casadi; pip install 'railcosim[native]'" in capfd.readouterr().err


def test_completion_knows_the_cases(folder):
    assert [name for name, _ in cases("")] == ["virm6_limit_100", "dash.toml"]
