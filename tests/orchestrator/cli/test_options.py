"""Options that several commands share: how figures are written."""

import json

import pytest
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.cli.options import PROBE_SECONDS, FormatName
from railcosim.orchestrator.figures import FORMATS
from railcosim.orchestrator.validation import TIMEOUT

SCENARIO = """
[simulation]
stop_time = 1.0
[instances.train]
component = "PointMassTrain"
start = { speed = 10.0, force = 0.0 }
[[figures]]
title = "Speed"
format = "pdf"
y = ["train.speed"]
"""


@pytest.fixture
def scenario(tmp_path):
    (tmp_path / "one.toml").write_text(SCENARIO)
    return tmp_path / "one.toml"


def drawn(folder):
    return sorted(path.name for path in folder.iterdir() if path.suffix[1:] in FORMATS)


def test_the_formats_of_the_command_line_are_those_of_the_figures():
    assert tuple(FormatName) == FORMATS


def test_what_the_command_line_says_without_loading_it_is_what_there_is():
    assert PROBE_SECONDS == TIMEOUT


def test_run_compare_and_plot_take_the_format_of_the_option_then_that_of_the_scenario(scenario, tmp_path):
    run = ["run", str(scenario), "--kind", "plain", "-q"]
    assert call([*run, "-o", str(tmp_path / "a")]) == 0
    assert drawn(tmp_path / "a") == ["speed.pdf"]
    assert call([*run, "-o", str(tmp_path / "b"), "--figure-format", "svg", "--dpi", "50"]) == 0
    assert drawn(tmp_path / "b") == ["speed.svg"]
    (wanted,) = json.loads((tmp_path / "b" / "run.json").read_text())["figures_wanted"]
    assert (wanted["format"], wanted["dpi"]) == ("svg", 50.0)
    assert call(["plot", str(tmp_path / "b"), "--figure-format", "png", "-o", str(tmp_path / "c")]) == 0
    assert drawn(tmp_path / "c") == ["speed.png"]
    compare = ["compare", str(scenario), "--swap", "train=PointMassTrain", "--kind", "plain", "-q"]
    assert call([*compare, "-o", str(tmp_path / "d"), "--figure-format", "svg"]) == 0
    assert drawn(tmp_path / "d") == ["speed.svg"]


@pytest.mark.parametrize(("option", "value"), [("--figure-format", "jpg"), ("--dpi", "1"), ("--dpi", "nan")])
def test_a_format_that_is_none_is_refused(option, value, scenario, tmp_path):
    assert call(["run", str(scenario), option, value, "-o", str(tmp_path / "a")]) == 2
