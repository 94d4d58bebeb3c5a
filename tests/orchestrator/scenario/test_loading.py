"""Scenarios from TOML to `System`: values, presets, changes, and every message a user can meet."""

import contextlib
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.scenario.loading import dump, find, load, loads, preset_names
from railcosim.orchestrator.scenario.shipped import MODELS, shipped

DOCS = Path(__file__).parents[3] / "docs" / "scenarios.md"
EXAMPLE = Path(__file__).with_name("two_trains.toml").read_text(encoding="utf-8")


def edited(*replacements):
    text = EXAMPLE
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    return text


def start(system, name):
    return {key: instance.start[name] for key, instance in system.instances.items() if name in instance.start}


def test_the_whole_of_a_scenario():
    system = loads(EXAMPLE, "folder/two.toml")
    assert (system.provenance.title, system.provenance.name, system.provenance.path) == (
        "Two trains",
        "two",
        "folder/two.toml",
    )
    assert (
        system.stepping.stop_time,
        system.stepping.step,
        system.stepping.record,
        system.stepping.algorithm,
        system.seed,
    ) == (
        120,
        0.5,
        1.0,
        "gauss-seidel",
        0,
    )
    assert list(system.instances) == ["train[1]", "train[2]", "cruise[1]", "cruise[2]", "target"]
    assert start(system, "position") == {"train[1]": 17e3, "train[2]": 0.0}
    assert start(system, "speed") == {"train[1]": 80.0, "train[2]": 80.0}
    assert start(system, "has_ahead") == {"cruise[1]": "i > 1", "cruise[2]": "i > 1"}
    assert start(system, "values") == {"target": [85.0, 80.0]}
    second, target = system.instances["train[2]"], system.instances["target"]
    assert (second.model, second.index, second.count, second.origin) == ("PointMassTrain", 2, 2, "folder/two.toml:9")
    assert (target.index, target.count, target.build) == (None, 1, {"points": 2})
    made = {c.target: c for c in system.connections}
    assert len(made) == 7
    assert (made["cruise[2].ahead_speed"].source, made["cruise[2].ahead_speed"].origin) == (
        "train[1].speed",
        "folder/two.toml:27",
    )
    assert (made["train[1].force"].delay, made["cruise[1].target_speed"].scale) == (1, 2.0)
    assert made["cruise[2].target_speed"].offset == 1.5
    assert (system.provenance.preset, system.provenance.presets, system.provenance.default_preset) == (
        "nominal",
        ("nominal", "gentle", "mixed"),
        "nominal",
    )
    assert not system.provenance.modified
    assert system.provenance.text == EXAMPLE
    assert system.judged.requirements.keys() | system.judged.metrics.keys() == {"comfort", "settling", "gap"}
    assert [entry["metric"] for entry in system.judged.published] == ["gap[2]"]
    assert [entry["metric"] for entry in system.judged.references] == ["settling"]
    assert system.judged.figures[0]["title"] == "Speed"
    assert [(event.signal, event.action, event.at, event.every) for event in system.events] == [
        ("cruise[1].ahead_speed", "bias", 30.0, 20.0),
        ("cruise[2].ahead_speed", "bias", 30.0, 20.0),
        ("target.value", "bias", 30.0, 20.0),
        ("train[1].disturbance", "set", 60.0, None),
    ]
    assert system.stepping.tolerances == {"train[1].speed": [1e-3, 0.0], "train[2].speed": [0.0, 2e-3]}


def test_origins_for_messages_of_later_checks():
    origins = loads(EXAMPLE, "two.toml", preset="gentle", settings=["train[2].speed=3"]).provenance.origins
    assert origins["train[1]"] == "two.toml:9"
    assert origins["train[1].speed"] == "two.toml:13"
    assert origins["train[2].speed"] == "--set train[2].speed=3"
    assert origins["cruise[1].has_ahead"] == "two.toml:18"
    assert origins["cruise[1].alpha"] == "two.toml:32"
    assert origins["simulation.step"] == "two.toml:6"
    assert origins["require.comfort"] == "two.toml:43"
    assert origins["metrics.gap"] == "two.toml:47"
    assert (origins["references[1]"], origins["published[1]"]) == ("two.toml:49", "two.toml:56")
    assert origins["figures[1]"] == "two.toml:62"
    assert (origins["events[1]"], origins["events[2]"]) == ("two.toml:66", "two.toml:74")
    assert origins["simulation.tolerances.train[1].speed"] == "two.toml:81"
    assert origins["simulation.tolerances.train[2].speed"] == "two.toml:82"


def test_the_outer_axis_of_a_list_is_the_instance_also_where_an_array_is_as_long():
    system = loads(edited(("start.speed = 80.0", "start.force = [[1, 2], [3, 4]]\nstart.limits = [5, 6]")))
    assert start(system, "force") == {"train[1]": [1, 2], "train[2]": [3, 4]}
    assert start(system, "limits") == {"train[1]": 5, "train[2]": 6}


def test_tables_and_dotted_names_of_start_values_are_the_same():
    text = '[simulation]\nstop_time = 1\n[instances.a]\ncomponent = "A"\n'
    one = loads(text + 'start.engine.torque = 1\nstart."x[2]" = 2')
    other = loads(text + '[instances.a.start]\n"engine.torque" = 1\n"x[2]" = 2')
    assert one == other
    assert one.instances["a"].start == {"engine.torque": 1, "x[2]": 2}


def test_one_instance_that_differs_and_instances_listed_singly():
    text = edited(
        ("[instances.cruise]", '[instances."train[2]"]\ncomponent = "Other"\nstart.speed = 3\n\n[instances.cruise]')
    )
    system = loads(text)
    assert [system.instances[f"train[{k}]"].model for k in (1, 2)] == ["PointMassTrain", "Other"]
    assert start(system, "speed") == {"train[1]": 80.0, "train[2]": 3}
    assert not system.instances["train[2]"].swapped
    more = text.replace("start.speed = 3", "start.speed = 3\nstep = 1.0\nisolate = false").replace(
        "start.speed = 80.0", "start.speed = 80.0\nisolate = true\nswapped = true"
    )
    assert [(one.step, one.isolate, one.swapped) for one in loads(more).instances.values()][:2] == [
        (None, True, True),
        (1.0, False, True),
    ]
    singly = '[simulation]\nstop_time = 1\n[instances."a[2]"]\ncomponent = "A"\nstart.x = [1, 2]\n'
    singly += '[instances."a[1]"]\ncomponent = "B"'
    system = loads(singly)
    assert [(a.name, a.model, a.index, a.count) for a in system.instances.values()] == [
        ("a[1]", "B", 1, 2),
        ("a[2]", "A", 2, 2),
    ]
    assert system.instances["a[2]"].start == {"x": [1, 2]}
    assert list(loads(singly + '\n[instances.b]\ncomponent = "B"\n').instances) == ["a[1]", "a[2]", "b"]


def test_order_names_instances_or_all_of_a_name():
    text = edited(("record = 1.0", 'order = ["cruise", "train[2]", "train[1]", "target"]'))
    assert loads(text).stepping.order == ["cruise[1]", "cruise[2]", "train[2]", "train[1]", "target"]


# -------------------------------------------------------------------- shipped scenarios, files


def test_shipped_scenarios_are_found_by_name_and_by_path(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    names = dict(shipped())
    assert names["comfort_cruise"] == "Comfort-aware cooperative cruise of four high-speed trains"
    for name in names:
        assert find(name) == MODELS / f"{name}.toml"
        assert find(MODELS / f"{name}.toml") == MODELS / f"{name}.toml"


def test_what_is_said_when_there_is_no_such_scenario(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(EXAMPLE)
    for name, message in {
        "comfort_crise": "there is no shipped scenario 'comfort_crise'; did you mean 'comfort_cruise'?",
        "zzz": "there is no shipped scenario 'zzz'; there are ato_comparison, ",
        "mine": "there is no shipped scenario 'mine'; did you mean './mine.toml'?",
        "min.toml": "there is no file 'min.toml'; did you mean 'mine.toml'?",
        "gone/x.toml": "there is no file 'gone/x.toml'; shipped scenarios are ato_comparison, ",
        str(tmp_path): f"'{tmp_path}' is a folder; name the scenario file in it",
    }.items():
        with pytest.raises(ScenarioError) as caught:
            find(name)
        assert str(caught.value).startswith(message)
    assert load("mine.toml").provenance.title == "Two trains"
    assert preset_names(tmp_path / "mine.toml") == ("nominal", "gentle", "mixed")


@pytest.mark.sample(8)
@pytest.mark.unmeasured
@pytest.mark.parametrize("name", [name for name, _ in shipped()])
def test_shipped_scenarios_open_with_source_and_expectation_and_load_under_every_preset(name):
    text = find(name).read_text(encoding="utf-8")
    comment = text[: text.index("\n\n")]
    assert all(line.startswith("#") for line in comment.splitlines())
    assert "Source:" in comment
    assert "Expect:" in comment
    for preset in preset_names(name):
        system = load(name, preset=preset)
        assert system.provenance.preset == preset
        assert not system.provenance.modified
        again = loads(dump(system))
        system.judged.published, system.judged.references = (
            [entry for entry in entries if entry.get("preset", system.provenance.default_preset) == preset]
            for entries in (system.judged.published, system.judged.references)
        )
        assert again == system


# -------------------------------------------------------------------- the documentation


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.DOTALL)


def test_the_example_of_the_documentation_loads():
    system = loads(blocks("toml")[0])
    assert len(system.instances) == 5
    assert len(system.connections) == 12
    assert loads(blocks("toml")[0], preset="gentle").instances["cruise[2]"].start["alpha"] == 0.01


def test_the_tolerances_and_events_of_the_documentation_are_read():
    frame = '[simulation]\nstop_time = 1\n[instances.mass]\ncomponent = "A"\n'
    frame += "".join(f'[instances.{name}]\ncomponent = "A"\ncount = 3\n' for name in ("train", "sensor", "cruise"))
    (tolerances,) = [block for block in blocks("toml") if "[simulation.tolerances]" in block]
    (events,) = [block for block in blocks("toml") if "[[events]]" in block]
    system = loads(frame + tolerances + events)
    assert system.stepping.tolerances["mass.position"] == [1e-6, 1e-3]
    assert [system.stepping.tolerances[f"train[{k}].speed"] for k in (1, 2, 3)] == [
        [1e-4, 1e-3],
        [0.0, 1e-4],
        [1e-4, 1e-3],
    ]
    assert [(event.signal, event.action, event.duration) for event in system.events] == [
        ("sensor[2].speed", "bias", 30.0),
        *((f"cruise[{k}].ahead_speed", "freeze", 5.0) for k in (1, 2, 3)),
    ]


def test_the_mistakes_of_the_documentation_are_told_as_it_says():
    text = blocks("toml")[0]
    for old, new in {
        "stop_time = 120.0": "stop_tme = 120.0",
        "[17e3, 0.0]": "[17e3, 0.0, 1.0]",
        '= "train[i].position"': '= "tran[i].position"',
        '"cruise[i].ahead_speed" = "train[i-1].speed"': '"cruise[i+1].ahead_position" = "train[i].position"',
        "always abs": "alway abs",
    }.items():
        assert old in text
        text = text.replace(old, new)
    with pytest.raises(ScenarioError) as caught:
        loads(text, "two_trains.toml", settings=["train[9].speed=10"])
    assert sorted(str(caught.value).splitlines()) == sorted(blocks("text")[0].splitlines())


def test_the_tables_of_the_documentation_name_every_key():
    from railcosim.orchestrator.evaluation.published import PUBLISHED_KEYS
    from railcosim.orchestrator.figures import PANEL_KEYS
    from railcosim.orchestrator.master import ALGORITHMS
    from railcosim.orchestrator.scenario.connections import CONNECTION_KEYS
    from railcosim.orchestrator.scenario.events import EVENT_KEYS
    from railcosim.orchestrator.scenario.reader import INSTANCE_KEYS, TOP_KEYS
    from railcosim.orchestrator.scenario.simulation import SIMULATION_KEYS
    from railcosim.orchestrator.system import ACCELERATIONS, ACTIONS, LOOPS

    text = DOCS.read_text(encoding="utf-8")
    for key in (*SIMULATION_KEYS, *PANEL_KEYS, *PUBLISHED_KEYS, *CONNECTION_KEYS, *INSTANCE_KEYS, *EVENT_KEYS):
        assert f"`{key}`" in text, key
    for word in (*ALGORITHMS, *LOOPS, *ACCELERATIONS, *ACTIONS):
        assert f'`"{word}"`' in text, word
    for key in TOP_KEYS:
        assert re.search(rf"`\[*{key}[`\].]", text), key


# -------------------------------------------------------------------- nothing but ScenarioError


LINES = [line for line in EXAMPLE.splitlines() if line]
SCRAP_VALUES = """-1 0 inf nan 1e308 5e-324 true "" "x" "i[1]." [] [[]] [1,2] {} {a=1} 2020-01-01 07:32:00 [{}] ["a"]
9223372036854775807 "a.fmu" "a.py:B" "\\u0000.fmu" "x.json" """
SCRAPS = [
    "[",
    "]",
    "=",
    '"',
    "{",
    "}",
    "i",
    "train[i].",
    "count = 99999",
    "[[published]]",
    "\n",
    ".",
    "1e999",
    "[instances.x]",
    "\x00",
    "é",
]


@settings(max_examples=300, deadline=None)
@given(st.lists(st.one_of(st.sampled_from(LINES), st.sampled_from(SCRAPS), st.text(max_size=12)), max_size=30))
def test_no_text_raises_anything_but_a_scenario_error(lines):
    with contextlib.suppress(ScenarioError):
        loads("\n".join(lines))


@settings(max_examples=300, deadline=None)
@given(
    st.sampled_from([line for line in LINES if "=" in line]),
    st.sampled_from(SCRAP_VALUES.split()),
)
def test_no_value_raises_anything_but_a_scenario_error(line, value):
    key = line.partition(" = ")[0]
    with contextlib.suppress(ScenarioError):
        loads(edited((line, f"{key} = {value}")), preset="mixed", step=0.25)


@settings(max_examples=300, deadline=None)
@given(
    st.text(max_size=25),
    st.sampled_from(["settings", "builds", "swaps", "preset", "algorithm"]),
    st.sampled_from(
        ["", "train.", "train[1].", "train.speed=", "cruise=", "simulation.step=", "simulation.", "target.build."]
    ),
)
def test_no_change_raises_anything_but_a_scenario_error(text, kind, beginning):
    change = beginning + text
    with contextlib.suppress(ScenarioError):
        loads(EXAMPLE, **{kind: change if kind in ("preset", "algorithm") else [change]})
