"""Cases as they are written, changed and refused."""

import pytest
from railcosim.orchestrator.driving import listed_cases, load_case
from railcosim.orchestrator.errors import ScenarioError

from .conftest import HOP


def test_the_shipped_case_is_listed_and_read():
    assert [case.name for case in listed_cases()] == ["virm6_limit_100"]
    case = load_case("virm6_limit_100")
    assert case.title == listed_cases()[0].title
    assert (case.begin, case.end, case.wish.time) == (0.0, 48531.0, 1541.0)
    train = case.train  # the file's, with the drive of the published problem
    assert (train.mass, train.rotating_mass, *train.resistance) == (391000.0, 0.06, 5854.0, 74.16, 12.96)
    assert train.traction == train.regeneration == (213900.0, 3129277.0, 0.73)
    assert (train.length, train.friction_brake, train.max_deceleration) == (0.0, 0.0, 0.0)


def test_what_comes_later_wins(hop):
    more = "[drive.overrides]\nline.altitude = 3.0\n[drive.overrides.train.traction]\npower = 5e5\n"
    case = hop("train.traction.force = 7e4", "jerk=0.5", "time=200", text=HOP + more, time=180.0, minimize=None)
    assert case.train.traction == (7e4, 5e5, 0.9)
    assert case.line.altitude == 3.0
    assert (case.wish.jerk, case.wish.time, case.wish.minimize) == (0.5, 180.0, "energy")


def test_places_are_stops_or_given(hop):
    assert [hop(*each).end for each in ((), ("end=900",))] == [2500.0, 900.0]
    without = HOP.replace("stops", "#")
    assert hop("begin=100", "end=900", text=without).begin == 100.0
    with pytest.raises(ScenarioError, match="no two stops; give 'begin' and 'end'"):
        hop("begin=100", text=without)


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        (["jerk"], "--set jerk: is not of the form key=value, as in train.mass=4e5"),
        (["=3"], "--set =3: is not of the form"),
        (["trian.mass=3"], "--set trian.mass=3: .*overrides begin with 'line.' or 'train.'"),
        (["jrek=3"], r"hop.toml:3: a case has no 'jrek'; did you mean 'jerk'\?"),
        (["time=soon"], "hop.toml:3: 'time' must be a number in s, not 'soon'"),
        (["time=0.1"], "hop.toml:3: 'time' is 0.1 .*in another unit"),
        (["minimize=money"], "'minimize' must be one of 'energy', 'time'"),
        (["train.mass=heavy"], "hop.toml:3: .*'train' is unusable: 'mass' must be a number in kg"),
        (["end=-5"], "hop.toml:3: 'end', -5 m, is not beyond 'begin', 0 m"),
        (["end_speed=23"], "'end_speed', 23 m/s, is above the limit there, 22 m/s"),
    ],
)
def test_unusable_settings(hop, settings, told):
    with pytest.raises(ScenarioError, match=told):
        hop(*settings)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("title = 'x'", "hop.toml: there is no table .drive.; write what is asked for there"),
        ("[instances]", "hop.toml: there is no table .drive.; 'orchestrate run' runs scenarios"),
        ("titel = 'x'\n[drive]", r"hop.toml:1: a case has no key 'titel'; did you mean 'title'\?"),
        ("[drive]", "hop.toml:1: 'line' is missing; name a file"),
        ("[drive]\nline = 3", "hop.toml:2: 'line' is 3; name a file"),
        ("[drive]\nline = 'no.json'", "hop.toml:2: line: .*no.json cannot be read: No such file"),
        (HOP.replace("time = 190.0", ""), "hop.toml:3: the least energy needs a running time; give 'time' in s"),
        (HOP.replace("time = 190.0", "overrides = 3"), "hop.toml:4: cannot set 3; overrides begin with"),
    ],
)
def test_unusable_files(hop, text, told):
    with pytest.raises(ScenarioError, match=told):
        hop(text=text)


def test_names_of_no_case():
    with pytest.raises(ScenarioError, match=r"no shipped case 'virm6_limit_10'; did you mean 'virm6_limit_100'\?"):
        load_case("virm6_limit_10")
    with pytest.raises(ScenarioError, match=r"there is no file 'no.toml'; there is virm6_limit_100"):
        load_case("no.toml")
