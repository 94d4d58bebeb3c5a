"""A scenario at a glance."""

from railcosim.orchestrator.cli.app import call


def test_a_quiet_check_of_a_good_scenario_says_nothing(capsys):
    assert call(["check", "comfort_cruise", "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert call(["check", "comfort_cruise"]) == 0
    assert capsys.readouterr().out.endswith("no errors\n")


LED = """[simulation]
stop_time = 9.0
[instances.train]
component = "PointMassTrain"
count = 2
start.position = [1e4, 0.0]
[instances.cruise]
component = "ComfortCruise"
count = 2
start.has_ahead = "i > 1"
start.target_speed = 50.0
[instances.other]
component = "Schedule"
build = { unit = "N" }
[connections]
"cruise[i].position" = "train[i].position"
"cruise[i].speed" = "train[i].speed"
"cruise[2].ahead_position" = "train[1].position"
"cruise[2].ahead_speed" = "train[1].speed"
"train[i].force" = "cruise[i].force"
[[events]]
signal = "train[2].force"
action = "connect"
at = 3.0
from = { from = "other.value", delay = 2 }
fade = 1.0
duration = 2.0
[[events]]
signal = "cruise[2].has_ahead"
action = "set"
value = false
at = 3.0
"""


def test_what_follows_what_from_when_on(capsys, tmp_path):
    (tmp_path / "led.toml").write_text(LED)
    assert call(["describe", str(tmp_path / "led.toml")]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert "3 s train[2].force connect from other.value (2 points later) fade 1.0 for 2.0" in shown
    assert call(["check", str(tmp_path / "led.toml")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "from 3 s on: train[2].force follows other.value" in lines
    assert sum(line.startswith("information: ") for line in lines) == 1
    assert not any(line.startswith("from 3 s on: information") for line in lines), "nobody hears anybody"
