"""What is supervised on a line with a train."""

import pytest
from railcosim.components.environment.track import read_line
from railcosim.components.supervision.etcs_targets import at_speed, read_train, supervised
from railcosim.components.trains.etcs_brakes import FLIRT

LINE = {
    "sections": [{"position": 0.0}],
    "speed_limits": [[0.0, 60.0], [1000.0, 50.0], [2000.0, 30.0], [3000.0, 40.0], [4000.0, 20.0]],
}


def test_targets_are_the_falls_below_the_trains_own_speed():
    """The FLIRT runs 44.4 m/s: 60 to 50 m/s is no fall for it. Each curve is 7.5 km/h above the new limit there."""
    known = supervised(read_line(LINE), read_train(FLIRT))
    assert [(t.location, t.speed) for t in known.targets] == [(2000.0, 30.0), (4000.0, 20.0)]
    for target in known.targets:
        assert target.curve.speed(target.location) == pytest.approx(target.speed + 7.5 / 3.6)
        assert target.curve.foot_speed == target.speed


def test_national_values_of_the_line_count():
    flat = read_line(LINE)
    adhesive = read_line({**LINE, "national": {"M_NVAVADH": 1.0, "Kt_int": 1.0}})
    stops = [supervised(line, read_train(FLIRT)).emergency.rising(9e3, 0.0).location(15.0) for line in (flat, adhesive)]
    assert stops[0] == pytest.approx(9e3 - 15.0**2 / (2 * 0.648))
    assert stops[1] == pytest.approx(9e3 - 15.0**2 / (2 * 0.72))


@pytest.mark.parametrize(("without", "said"), [("etcs", "'etcs'"), ("length", "'length'")])
def test_a_train_must_tell_what_supervision_needs(without, said):
    with pytest.raises(ValueError, match=f"supervision needs the train's {said}"):
        read_train({key: value for key, value in FLIRT.items() if key != without})


def test_a_step_function_of_the_speed():
    assert [at_speed(((0.0, 0.9), (20.0, 0.8)), v) for v in (0.0, 19.9, 20.0, 50.0)] == [0.9, 0.9, 0.8, 0.8]
