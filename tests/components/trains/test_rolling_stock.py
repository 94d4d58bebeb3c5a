"""The format of a train, and the trains that are shipped."""

import json
from pathlib import Path

import pytest
from railcosim import models
from railcosim.components import ComponentError, Line
from railcosim.components.trains.rolling_stock import TRAIN

FOLDER = Path(models.__file__).parent
FLIRT = json.loads((FOLDER / "rolling_stock" / "flirt.json").read_text(encoding="utf-8"))


def test_a_shipped_train_by_hand():
    """122 t, 200 kN, 2600 kW; r0 2.37888 kN, r1 0.01698165 kN/(km/h), r2 0.00046632 kN/(km/h)^2."""
    train = TRAIN.record(FLIRT)
    assert train.resistance == pytest.approx((2378.88, 16.98165 * 3.6, 0.46632 * 3.6**2), rel=1e-11)
    assert train.traction == (200e3, 2600e3, 0.9)
    assert train.etcs.emergency[1] == (20.0, 0.85)
    assert (train.mass, train.rotating_mass, train.max_speed) == pytest.approx((122e3, 0.1, 160 / 3.6), rel=1e-11)


@pytest.mark.parametrize("path", sorted(FOLDER.glob("rolling_stock/*.json")), ids=lambda path: path.stem)
def test_every_shipped_train_tells_its_source_licence_and_units(path):
    data = json.loads(path.read_text(encoding="utf-8"))
    assert TRAIN.record(data).mass > 1e5
    assert all(data[key] for key in ("name", "source", "licence", "units"))


@pytest.mark.parametrize("path", sorted(FOLDER.glob("lines/*.json")), ids=lambda path: path.stem)
def test_every_shipped_line_tells_its_source_licence_and_units(path):
    data = json.loads(path.read_text(encoding="utf-8"))
    assert len(Line(line=data).line.stops) > 1
    assert all(data[key] for key in ("name", "source", "licence", "units"))


def test_the_drag_of_a_tunnel_between_two_sections_is_linear():
    train = TRAIN.record({"mass": 1e5, "tunnel_resistance": [[24.0, 15.0], [40.0, 7.0]]})
    assert train.tunnel_drags([0.0, 20.0, 24.0, 32.0, 40.0, 60.0]) == [0.0, 15.0, 15.0, 11.0, 7.0, 7.0]
    assert TRAIN.record({"mass": 1e5}).tunnel_drag(30.0) == 0.0


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"mass": 122.0}, "'mass' is 122.0 (in kg), which is beyond all that runs"),
        ({"mass": None}, "'mass' must be a number in kg"),
        ({"rotating_mass": 10.0}, "'rotating_mass' is 10.0 (share of the mass)"),
        ({"traction": {"force": -1.0, "power": 1e6}}, "'force' is -1.0"),
        ({"tunnel_resistance": [[40.0, 7.0], [24.0, 15.0]]}, "tunnel 2: 'area' must exceed 40"),
        ({"weight": 1.0}, "a train has no 'weight'"),
    ],
)
def test_unusable_trains_are_refused(change, complaint):
    with pytest.raises(ComponentError) as told:
        Line(train=FLIRT | change)
    assert complaint in str(told.value)
