"""What `describe` says of a model and of a scenario, and how help is asked for."""

import re

import pytest
from railcosim.fmus import build
from railcosim.orchestrator import packing
from railcosim.orchestrator.cli.app import app, call
from typer.main import get_command


@pytest.mark.parametrize("name", ["", *get_command(app).commands])
def test_every_command_takes_the_short_form_of_help(name, capsys):
    texts = []
    for option in ("-h", "--help"):
        assert call([*([name] if name else []), option]) == 0
        texts.append(capsys.readouterr().out)
    assert texts[0] == texts[1]
    assert "Usage: " in texts[0]


@pytest.mark.parametrize(
    ("obstacle", "lines"),
    [("", []), ("there is no C compiler", ["not native: there is no C compiler"])],
)
def test_describe_says_the_kind_that_a_run_would_take(obstacle, lines, capsys, monkeypatch):
    if obstacle:
        monkeypatch.setattr(build, "native_problem", lambda component: obstacle)
    elif build.native_problem(build.resolve("Gust")):
        pytest.skip("native FMUs cannot be made here")
    assert call(["describe", "Gust"]) == 0
    text = capsys.readouterr().out
    assert f"\nkind: {'python' if obstacle else 'native'}: " in text
    assert re.findall("^not native: .*", text, re.MULTILINE) == lines


SCENARIO = """
title = "Three trains"
source = "nobody"
default_preset = "calm"
[simulation]
stop_time = 20.0
step = 0.5
[instances.train]
component = "PointMassTrain"
count = 3
start = { position = [0.0, 1.0, 2.0], force = 0.0 }
[instances.wind]
component = "Gust"
[connections]
"train[2].disturbance" = "wind.acceleration"
"train[3].disturbance" = "wind.acceleration"
"train[1].disturbance" = { from = "wind.acceleration", scale = 2.0, delay = 1 }
[presets.fast]
description = "twice as fast"
"train.speed" = 20.0
[[events]]
at = 3.0
signal = "wind.acceleration"
action = "bias"
value = 0.1
[require]
forward = "always train[i].speed >= 0"
[metrics]
slowest = "min(train[:].speed)"
[[published]]
metric = "slowest"
value = 10.0
origin = "misprint"
[[figures]]
title = "Speed of all"
y = ["train[:].speed"]
"""


def test_describe_tells_what_a_scenario_holds(tmp_path, capsys, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    (tmp_path / "three.toml").write_text(SCENARIO)
    assert call(["describe", str(tmp_path / "three.toml")]) == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    wanted = [
        "Three trains",
        "source: nobody",
        "steps: gauss-seidel, every 0.5 s from 0 to 20 s",
        "Presets",
        "calm as it stands",
        "fast twice as fast",
        "train 3 PointMassTrain",
        "train[i].disturbance wind.acceleration 2 times",
        "train[1].disturbance wind.acceleration times 2, 1 point later",
        "3 s wind.acceleration bias value 0.1",
        "forward always train[i].speed >= 0",
        "slowest min(train[:].speed)",
        "Published values: 1 misprint",
        "Speed of all",
    ]
    places = [next(k for k, line in enumerate(lines) if line.startswith(part)) for part in wanted]
    assert places == sorted(places)


def test_describe_takes_the_name_of_a_shipped_scenario_and_its_build_arguments(capsys):
    assert call(["describe", "comfort_cruise", "--with", "target.points=2"]) == 0
    text = capsys.readouterr().out
    assert re.search(r"^target +1 +Schedule +points = 2, unit = 'm/s'", text, re.MULTILINE)


@pytest.mark.parametrize(("name", "nearest"), [("comfort_cruse", "comfort_cruise"), ("ComfortCruse", "ComfortCruise")])
def test_a_name_that_is_neither_is_told_with_the_nearest_of_both(name, nearest, capsys):
    assert call(["describe", name]) == 2
    told = f"error: there is no component or shipped scenario '{name}'; did you mean '{nearest}'?\n"
    assert capsys.readouterr().err == told


def test_describe_tells_what_another_file_is(tmp_path, xml, capsys):
    inside = {"SystemStructure.ssd": "<x/>", "resources/a.fmu": ""}
    odd = xml["write_archive"](tmp_path / "system.fmu", inside)
    for name, what in (
        (odd, "is an SSP, a system of 1 FMUs; call it .ssp"),
        (tmp_path, "is a folder, not an FMU file"),
        (xml["write_archive"](tmp_path / "system.ssp", inside), "SystemStructure.ssd:1: it is a x, not a System"),
    ):
        assert call(["describe", str(name)]) == 2
        assert what in capsys.readouterr().err


def test_pack_says_what_it_has_written(capsys, monkeypatch, tmp_path):
    packed = packing.Packed(tmp_path / "a.fmu", (), ("linux64", "win64"), ("a note",))
    monkeypatch.setattr(packing, "pack", lambda system, path, **how: packed)
    written = f"{tmp_path / 'a.fmu'}: 10 FMUs as one, 0 variables, for linux64, win64"
    for more, lines in (((), ["note: a note", written]), (("--quiet",), ["note: a note"])):
        assert call(["pack", "comfort_cruise", "-o", str(packed.path), *more]) == 0
        assert capsys.readouterr().out.splitlines() == lines
