"""Lines and trains of TTOBench: small files of our own with the library's keys, and the whole library where it is."""

import copy
import json
import logging
import os
from pathlib import Path

import pytest
from railcosim.components import ComponentError
from railcosim.fmus.references import build_with, resolve

TRACK = {
    "metadata": {"id": "XX_Here_There", "created by": "Somebody", "library version": "TTOBench v1.5", "license": "BSD"},
    "altitude": {"unit": "m", "value": 12},
    "stops": {"unit": "m", "values": [0.0, 2000.0]},
    "speed limits": {"units": {"position": "m", "velocity": "km/h"}, "values": [[0.0, 90], [500.0, 72]]},
    "gradients": {"units": {"position": "km", "slope": "permil"}, "values": [[0.0, 4.0], [1.0, -5.0]]},
    "curvatures": {
        "units": {"position": "m", "radius at start": "m", "radius at end": "m"},
        "values": [[0.0, "infinity", "infinity"], [200.0, 400.0, -400.0], [300.0, -400.0, -400.0]],
    },
    "tunnels": {"units": {"position": "m", "length": "m", "cross section": "m^2"}, "values": [[1200.0, 300.0, 40]]},
    "ETCS braking data": {"M_NVAVADH": {"unit": "-", "value": 0}, "Kt_int": {"unit": "-", "value": 1.15}},
}
TRAIN = {
    "metadata": {"id": "XX_Train", "library version": "TTOBench v1.5"},
    "num seats": {"unit": "-", "value": 167},
    "length": {"unit": "m", "value": 60.0},
    "mass": {"unit": "t", "value": 120.0},
    "rho": {"unit": "%", "value": 10},
    "max traction power": {"unit": "kW", "value": 2000.0},
    "max reg braking power": {"unit": "kW", "value": 1500.0},
    "max traction force": {"unit": "kN", "value": 200.0},
    "max reg braking force": {"unit": "kN", "value": 150.0},
    "max speed": {"unit": "km/h", "value": 180},
    "rolling resistance r0": {"unit": "kN", "value": 2.0},
    "rolling resistance r1": {"unit": "kN/(km/h)", "value": 0.01},
    "rolling resistance r2": {"unit": "kN/(km/h)^2", "value": 0.001},
    "efficiency traction": {"unit": "%", "value": 90.0},
    "tunnel resistance": {
        "units": {"cross section": "m^2", "coefficient": "kN/(km/h)^2"},
        "values": [[24, 0.001], [40, 0.0005]],
    },
    "ETCS braking data": {
        **{
            name: {"units": {"velocity": "km/h", "deceleration": "m/s^2"}, "values": [[0, 0.9], [72, 0.8]]}
            for name in ("A_brake_emergency", "A_brake_service")
        },
        **{name: {"unit": "-", "value": 0.8} for name in ("K_dry_rst", "K_wet_rst")},
        **{name: {"unit": "s", "value": 3} for name in ("T_traction", "T_be", "T_bs")},
        "v_uncertainty": {"unit": "%", "value": 2.98},
    },
}


@pytest.fixture
def read(tmp_path):
    """A `Line` built with a line and a train from files of these contents."""

    def build(line=TRACK, train=TRAIN):
        paths = {"line": tmp_path / "line.json", "train": tmp_path / "train.json"}
        for path, content in zip(paths.values(), (line, train), strict=True):
            path.write_text(json.dumps(content), encoding="utf-8")
        return build_with(resolve("Line"), {name: str(path) for name, path in paths.items()})

    return build


def test_a_line_comes_in_si_units(read):
    line = read().line
    assert [tuple(step) for step in line.limits.steps] == [(0.0, 25.0), (500.0, 20.0)]
    assert [stop.position for stop in line.stops] == [0.0, 2000.0]
    assert line.altitude == 12.0
    assert line.national == {"M_NVAVADH": 0.0, "Kt_int": 1.15}
    assert line.positions == [0.0, 200.0, 250.0, 300.0, 1000.0, 1200.0, 1500.0]
    assert line.gradients == [0.004] * 4 + [-0.005] * 3
    assert line.areas == [0.0] * 5 + [40.0, 0.0]
    ahead, behind = line.transitions  # from one hand to the other, straight between: 400 m to 0 to 400 m
    assert (ahead.begin, ahead.end, ahead.curvature) == (200.0, 250.0, 1 / 400.0)
    assert (behind.begin, behind.end, behind.curvature) == (250.0, 300.0, 0.0)
    assert behind.slope == -ahead.slope == 1 / 400.0 / 50.0
    assert line.opposing[3] == 9.81 * 650.0 / (400.0 - 55.0) / 1000.0


def test_a_train_comes_in_si_units(read):
    train = read().train
    assert (train.mass, train.rotating_mass, train.length, train.max_speed) == (120e3, 0.1, 60.0, 50.0)
    assert train.resistance == pytest.approx((2000.0, 36.0, 12.96), rel=1e-15)
    assert (train.traction, train.regeneration) == ((200e3, 2e6, 0.9), (150e3, 1.5e6, 1.0))
    assert [value for row in train.tunnels for value in row] == pytest.approx([24.0, 12.96, 40.0, 6.48])
    assert train.friction_brake == 0.0
    assert train.etcs.service == ((0.0, 0.9), (20.0, 0.8))
    assert train.etcs.speed_uncertainty == pytest.approx(0.0298)


def test_what_is_optional_may_be_missing(read):
    needed = ("metadata", "stops", "speed limits")
    plain = read({key: TRACK[key] for key in needed}, {k: TRAIN[k] for k in TRAIN if not k.startswith(("E", "t", "l"))})
    assert (plain.line.gradients, plain.line.transitions, plain.line.national) == ([0.0], [], None)
    assert (plain.train.length, plain.train.tunnels, plain.train.etcs) == (0.0, (), None)


def test_a_gradient_that_changes_within_a_transition_curve_splits_it(read):
    split = copy.deepcopy(TRACK)
    split["gradients"]["values"] = [[0.0, 4.0], [0.225, 0.0], [0.29, 1.0]]
    split["curvatures"]["values"] = [[0.0, 800.0, 800.0], [200.0, 800.0, 400.0], [300.0, 400.0, 400.0]]
    split["tunnels"]["values"] = [[1200.0, 300.0, 40], [1600.0, 100.0, 24]]
    line = read(split).line
    assert line.positions == [0.0, 200.0, 225.0, 290.0, 300.0, 1200.0, 1500.0, 1600.0, 1700.0]
    slope = (1 / 400.0 - 1 / 800.0) / 100.0
    begins = [200.0, 225.0, 290.0]
    assert [curve.begin for curve in line.transitions] == begins
    assert [curve.curvature for curve in line.transitions] == pytest.approx(
        [1 / 800.0 + slope * (b - 200.0) for b in begins]
    )
    assert [curve.slope for curve in line.transitions] == pytest.approx([slope] * 3)


@pytest.mark.parametrize(
    ("place", "value", "complaint"),
    [
        (["train", "mass"], None, "'mass' is missing"),
        (["train", "mass"], 5.0, "'mass' is no object: 5.0"),
        (["train", "mass", "value"], -1.0, "'mass': -1.0 is negative"),
        (
            ["train", "mass", "value"],
            "120,5",
            "'mass': a number is wanted, not the text '120,5': a decimal point, not a",
        ),
        (["train", "mass", "value"], "120.5", "'mass': a number is wanted, not the text '120.5'"),
        (["train", "mass", "value"], float("nan"), "'mass': a finite number is wanted, not nan"),
        (["train", "mass", "unit"], "kN", "'mass': 'kN' is no unit of a mass; known: kg, t"),
        (["train", "mass", "unit"], None, "'mass': it has no 'unit'"),
        (["train", "max sped"], {"unit": "km/h", "value": 1}, "no key 'max sped'; did you mean 'max speed'?"),
        (["train", "ETCS braking data", "T_be"], None, "'ETCS braking data': 'T_be' is missing"),
        (["train", "ETCS braking data", "T"], 1, "'ETCS braking data': no key 'T'"),
        (["line", "stops", "values"], [0.0], "'stops': the first is at 0 and the last at the end"),
        (["line", "stops", "values"], [0.0, 900.0, 800.0], "'stops' row 3: position 800 does not exceed 900"),
        (["line", "speed limits", "units"], None, "'speed limits': it has no 'units', one for each of position, vel"),
        (["line", "speed limits", "units", "velocity"], "mph", "'speed limits' row 1, velocity: 'mph' is no unit of"),
        (["line", "speed limits", "values"], [], "'speed limits': 'values' is a list of at least one row"),
        (["line", "speed limits", "values"], [[0.0]], "'speed limits' row 1: it has 2 values, position, velocity"),
        (["line", "speed limits", "values"], [[5.0, 80]], "'speed limits': the first begins at 0"),
        (["line", "gradients", "values"], [[0.0, 1.0], [2.0, 3.0]], "'gradients': the first begins at 0, the last bef"),
        (["line", "gradients", "values"], [[0.0, "1,5"]], "'gradients' row 1, slope: a number is wanted"),
        (["line", "gradients", "values"], [[0.0, 500.0]], "section 1: 'gradient' is 0.5 (rise over run), which is bey"),
        (
            ["line", "curvatures", "values"],
            [[0.0, 0.0, 0.0]],
            'a radius of 0 is no curve; straight track is "infinity"',
        ),
        (["line", "tunnels", "values"], [[5.0, 10.0, 40], [9.0, 5.0, 40]], "'tunnels' row 1: it ends at 15 m, beyond"),
        (["line", "tunnels", "values"], [[1900.0, 300.0, 40]], "'tunnels': position 2200 m is not on the line"),
        (["line", "metadata"], {"id": "no stops"}, None),
        (["line", "timing points"], {}, "'timing points' are a journey's"),
    ],
)
def test_what_is_wrong_is_told_with_file_and_key(read, tmp_path, place, value, complaint):
    given = {"line": copy.deepcopy(TRACK), "train": copy.deepcopy(TRAIN)}
    inner = given
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    if value is None:
        del inner[place[-1]]
    if complaint is None:
        assert read(**given).line.altitude == 12.0
        return
    with pytest.raises(ComponentError) as told:
        read(**given)
    assert str(tmp_path / f"{place[0]}.json") in str(told.value)
    assert complaint in str(told.value)


@pytest.mark.parametrize(("value", "warned"), [(0.00093264, True), (0.00046632, False)])
def test_the_librarys_known_flaw_is_told(read, caplog, value, warned):
    flirt = copy.deepcopy(TRAIN)
    flirt["metadata"]["id"] = "CH_Stadler_FLIRT_TPF"
    flirt["rolling resistance r2"]["value"] = value
    with caplog.at_level(logging.WARNING):
        assert read(train=flirt).train.resistance.c == pytest.approx(value * 12960.0)
    assert ["twice what the library's source gives" in record.message for record in caplog.records] == [True] * warned


def _library():
    folder = os.environ.get("RAILCOSIM_TTOBENCH")
    if not folder:
        pytest.skip("RAILCOSIM_TTOBENCH does not name the folder of the TTOBench library")
    return Path(folder)


def test_every_line_and_train_of_the_library_is_read():
    files = [("line", path) for path in (_library() / "tracks").glob("*.json")]
    files += [("train", path) for path in (_library() / "trains").glob("*.json")]
    assert len(files) >= 19
    for name, path in files:
        raw = json.loads(path.read_text(encoding="utf-8"))
        found = getattr(build_with(resolve("Line"), {name: str(path)}), name)
        if name == "train":
            assert found.mass == raw["mass"]["value"]
        else:
            assert [stop.position for stop in found.stops] == raw["stops"]["values"]
            steps = [[b, v / 3.6] for b, v in raw["speed limits"]["values"]]
            assert [list(step) for step in found.limits.steps] == steps


@pytest.mark.parametrize(
    ("theirs", "ours", "name"),
    [
        ("tracks/CN_Songjiazhuang_Yizhuang.json", "lines/yizhuang.json", "line"),
        ("tracks/CH_Fribourg_Bern.json", "lines/fribourg_bern.json", "line"),
        ("trains/CH_Stadler_FLIRT_TPF.json", "rolling_stock/flirt.json", "train"),
        ("trains/NL_Intercity_VIRM6.json", "rolling_stock/virm6.json", "train"),
        ("trains/CN_Beijing_Subway.json", "rolling_stock/beijing_subway.json", "train"),
    ],
)
def test_what_is_shipped_has_the_librarys_figures(theirs, ours, name):
    from railcosim import models

    files = (_library() / theirs, Path(models.__file__).parent / ours)
    one, two = (getattr(build_with(resolve("Line"), {name: str(path)}), name) for path in files)
    if name == "line":
        assert two.gradients[: len(one.gradients)] == pytest.approx(one.gradients, rel=1e-11)
        steps = list(two.limits.steps)[: len(one.limits.steps)]
        assert [value for step in steps for value in step] == pytest.approx(
            [value for step in one.limits.steps for value in step], rel=1e-11
        )
        return
    assert (two.traction, two.regeneration) == (one.traction, one.regeneration)
    halved = 0.5 if "FLIRT" in theirs else 1.0
    assert two.resistance == pytest.approx((one.resistance.a, one.resistance.b, halved * one.resistance.c), rel=1e-11)
