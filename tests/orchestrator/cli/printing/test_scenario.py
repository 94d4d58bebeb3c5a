"""A scenario at a glance."""

from railcosim.orchestrator.cli.app import call


def test_a_quiet_check_of_a_good_scenario_says_nothing(capsys):
    assert call(["check", "comfort_cruise", "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert call(["check", "comfort_cruise"]) == 0
    assert capsys.readouterr().out.endswith("no errors\n")
