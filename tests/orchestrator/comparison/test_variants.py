"""Variants side by side: what they are, which way is better, who wins, what fails, what is left behind."""

import csv
import json

import numpy as np
import pytest
import typer
from matplotlib.figure import Figure
from railcosim.orchestrator.cli import analysis as cli_analysis
from railcosim.orchestrator.cli.documents import answering
from railcosim.orchestrator.comparison.preference import better, read_directions, winners
from railcosim.orchestrator.comparison.variants import compare, variants
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.run.execution import run
from typer.testing import CliRunner

SMALL = """
title = "A train on its own"
default_preset = "calm"
[simulation]
stop_time = 2.0
step = 0.1
[instances.train]
component = "PointMassTrain"
start = { speed = 10.0, force = 0.0 }
[presets.fast]
"train.speed" = 20.0
[require]
slow = "always train.speed < 15"
[metrics]
start = "initial(train.speed)"
effort = "peak(train.acceleration)"
way = "final(train.position)"
late = "settling_time(train.speed - 20, 1.0)"
[[figures]]
title = "Speed and way"
[[figures.panels]]
y = ["train.speed"]
[[figures.panels]]
y = ["train.speed", "train.acceleration"]
"""


@pytest.fixture
def small(tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)
    return str(tmp_path / "small.toml")


# ---------------------------------------------------------------- the variants


def test_one_scenario_has_its_presets_and_swaps_as_variants_after_itself():
    found = variants(
        ["comfort_cruise"],
        presets=["as-stated", "figure-consistent"],
        swaps=["cruise=RangePotentialCruise", "cruise[2]=FixedDistanceCruise,train=PointMassTrain"],
    )
    assert list(found) == [
        "figure-consistent",
        "as-stated",
        "cruise=RangePotentialCruise",
        "cruise[2]=FixedDistanceCruise,train=PointMassTrain",
    ]
    assert found["as-stated"].provenance.preset == "as-stated"
    assert found["cruise=RangePotentialCruise"].instances["cruise[1]"].model == "RangePotentialCruise"
    assert found["cruise=RangePotentialCruise"].provenance.preset == "figure-consistent"


def test_of_several_scenarios_each_has_the_presets_it_knows():
    found = variants(
        ["comfort_cruise", "comfort_cruise_bottom_layer"], presets=["as-stated", "no-gust"], stop_time=10.0
    )
    assert list(found) == [
        "comfort_cruise",
        "comfort_cruise as-stated",
        "comfort_cruise no-gust",
        "comfort_cruise_bottom_layer",
        "comfort_cruise_bottom_layer as-stated",
    ]
    assert {system.stepping.stop_time for system in found.values()} == {10.0}


def test_settings_hold_for_all_variants(small):
    found = variants([small], presets=["fast"], settings=["train.c0=0.5"])
    assert [system.instances["train"].start["c0"] for system in found.values()] == [0.5, 0.5]
    assert [system.instances["train"].start["speed"] for system in found.values()] == [10.0, 20.0]


def test_a_preset_that_no_scenario_has_is_refused():
    with pytest.raises(ScenarioError, match="none of the scenarios has a preset 'nope'"):
        variants(["comfort_cruise", "comfort_cruise_bottom_layer"], presets=["nope"])
    with pytest.raises(ScenarioError, match="did you mean 'as-stated'"):
        variants(["comfort_cruise"], presets=["as-statd"])


# ---------------------------------------------------------------- better


@pytest.mark.parametrize(
    ("expression", "direction"),
    [
        ("settling_time(train[:].speed - target.value, 1.0)", "smaller"),
        ("overshoot(train[i].speed, target.value)", "smaller"),
        ("peak(train[1].acceleration)", "smaller"),
        ("comfort(train[i].acceleration)", "smaller"),
        ("rms(train[i].acceleration)", "smaller"),
        ("jerk(train[i].acceleration)", "smaller"),
        ("traction_energy(train.force, train.speed)", "smaller"),
        ("duration(cruise[i].range_violated)", "smaller"),
        ("max(abs(train.position))", "smaller"),
        ("max(ato.speed_error)", "smaller"),
        ("peak(train.acceleration) - 1", "smaller"),
        ("-peak(train.acceleration)", "larger"),
        ("100 / 2", "none"),
        ("peak(train.acceleration) * 2", "smaller"),
        ("min(train[i-1].position - train[i].position)", "larger"),
        ("min(train[1:3].position - train[2:4].position) - 250", "larger"),
        ("time_to_collision(train[1].position - train[2].position, train[2].speed - train[1].speed)", "larger"),
        ("headway_capacity(train[1].position - train[2].position, train[2].speed)", "larger"),
        ("min(train.speed)", "none"),
        ("final(train.position)", "none"),
        ("peak(train[1].speed) - peak(train[2].speed)", "none"),
        ("this is no expression", "none"),
    ],
)
def test_the_outermost_reducer_tells_what_is_better(expression, direction):
    assert better(expression) == direction


@pytest.mark.parametrize(
    ("values", "direction", "places"),
    [
        ((1.0, 2.0, 3.0), "smaller", (0,)),
        ((1.0, 2.0, 3.0), "larger", (2,)),
        ((1.0, 2.0, 3.0), "none", ()),
        ((138.7, np.inf, np.inf), "smaller", (0,)),
        ((2.0, np.nan, 1.0), "smaller", (2,)),
        ((2.0, np.nan), "smaller", ()),
        ((1.0, 1.0 + 1e-12, 2.0), "smaller", (0, 1)),
        ((1.0, 1.0, 1.0), "smaller", ()),
        ((np.inf, np.inf), "smaller", ()),
    ],
)
def test_winners(values, direction, places):
    assert winners(values, direction) == places


def test_a_user_may_say_what_is_better():
    metrics = {"way": "final(train.position)"}
    assert read_directions(["way=larger"], metrics) == {"way": "larger"}
    with pytest.raises(ScenarioError) as error:
        read_directions(["wya=larger", "way=more"], metrics)
    assert "did you mean 'way'?" in str(error.value)
    assert "write METRIC=smaller" in str(error.value)


# ---------------------------------------------------------------- the comparison


def test_the_table_holds_what_single_runs_give(small):
    systems = variants([small], presets=["fast"])
    comparison = compare(systems, kind="plain", directions={"way": "larger"})
    alone = {name: run(system, kind="plain") for name, system in systems.items()}
    rows = {row.name: row for row in comparison.rows}
    assert list(rows) == ["start", "effort", "way", "late"]
    for row in rows.values():
        single = [next(m for m in alone[name].metrics if m.name == row.metric).values[None] for name in systems]
        assert row.values == tuple(single)
    assert rows["start"].winners == ()
    assert rows["effort"].winners == (0,)
    assert rows["way"].winners == (1,)
    assert (rows["late"].values, rows["late"].winners) == ((np.inf, 0.0), (1,))
    assert comparison.wins() == [1, 2]
    assert comparison.verdicts() == {"slow": ["pass", "fail"]}
    assert comparison.requirement_failed


def test_a_variant_that_fails_is_shown_and_the_others_go_on(small, tmp_path):
    systems = variants([small], presets=["fast"])
    broken = variants([small])["calm"]
    broken.add("cruise", "ComfortCruise")  # its inputs are not connected
    comparison = compare({"broken": broken, **systems}, kind="plain", output=tmp_path / "out")
    assert [variant.status for variant in comparison.variants] == ["failed", "completed", "completed"]
    assert "required input" in comparison.variants[0].error
    assert np.isnan(comparison.rows[0].values[0])
    assert comparison.broken
    assert [figure.name for figure in comparison.figures] == ["speed-and-way.png"]


def test_if_none_can_run_the_reasons_are_told(small):
    system = variants([small])["calm"]
    system.connect("train.nothing", "train.force")
    with pytest.raises(ScenarioError, match=r"calm: .*has no variable 'nothing'"):
        compare({"calm": system}, kind="plain")


def test_names_that_give_one_folder_are_told_apart(small, tmp_path):
    system = variants([small])["calm"]
    comparison = compare({"a=b": system, "a b": system}, kind="plain", output=tmp_path, figures=False)
    assert [variant.directory.name for variant in comparison.variants] == ["a-b", "a-b~2"]


# ---------------------------------------------------------------- the command


@pytest.fixture(scope="module")
def orchestrate():
    app = typer.Typer()
    app.command()(answering(cli_analysis.linearize))
    app.command()(answering(cli_analysis.compare))

    def invoke(*arguments):
        with pytest.MonkeyPatch.context() as patch:
            patch.delenv("COLUMNS", raising=False)
            return CliRunner().invoke(app, ["compare", *(str(argument) for argument in arguments)])

    return invoke


def test_the_command_prints_one_table_and_leaves_everything_in_one_place(orchestrate, small, tmp_path):
    out = tmp_path / "out"
    done = orchestrate(small, "--preset", "fast", "--better", "way=larger", "--kind", "plain", "-o", out)
    assert done.exit_code == 1, done.output  # the requirement fails under one preset
    assert "requirement slow fails: fast" in done.output
    assert "best alone, of 3 rows in which less or more is better: calm 1, fast 2" in done.output
    with (out / "compare.csv").open(newline="") as stream:
        table = list(csv.DictReader(stream))
    assert list(table[0]) == ["metric", "index", "unit", "better", "calm", "fast", "winner"]
    assert [row["winner"] for row in table] == ["", "calm", "fast", "fast"]
    content = json.loads((out / "compare.json").read_text())
    assert content["rows"][3]["values"] == {"calm": "inf", "fast": 0.0}
    assert [variant["status"] for variant in content["variants"]] == ["completed", "completed"]
    for name in ("calm", "fast"):
        assert {path.name for path in (out / name).iterdir()} >= {"results.csv", "metrics.json", "run.json"}
    assert (out / "speed-and-way.png").read_bytes().startswith(b"\x89PNG")


def test_quiet_prints_what_failed_only(orchestrate, small, tmp_path):
    done = orchestrate(small, "--preset", "fast", "--kind", "plain", "-q", "--no-figures", "-o", tmp_path / "out")
    assert done.exit_code == 1
    assert done.output == "requirement slow fails: fast\n"
    assert not list((tmp_path / "out").glob("*.png"))


def test_a_variant_that_lacks_a_signal_is_drawn_without_it(small, tmp_path):
    other = variants([small])["calm"]
    other.judged.metrics, other.judged.requirements, other.judged.figures = {}, {}, []
    other.instances = {"wagon": other.instances["train"]}
    other.instances["wagon"].name = "wagon"
    comparison = compare({**variants([small]), "other": other}, kind="plain", output=tmp_path / "out")
    assert [variant.status for variant in comparison.variants] == ["completed", "completed"]
    assert len(comparison.figures) == 1


def test_compared_figures_say_which_variant_is_reconstructed(tmp_path, monkeypatch):
    kept = []
    monkeypatch.setattr(Figure, "savefig", lambda self, *_, **__: kept.append(self._suptitle.get_text()))
    laws = ("RangePotentialCruise", "ComfortCruise")
    systems = variants(["comfort_cruise"], swaps=[f"cruise={law}" for law in laws], stop_time=1.0)
    compare(systems, kind="plain", output=tmp_path)
    assert kept
    assert all(text.endswith("\nreconstructed in cruise=RangePotentialCruise") for text in kept)
