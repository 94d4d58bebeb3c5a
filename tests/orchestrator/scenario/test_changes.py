"""Presets and changes on the command line; every message read."""

from pathlib import Path

import pytest
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.scenario.loading import dump, loads

EXAMPLE = Path(__file__).with_name("two_trains.toml").read_text(encoding="utf-8")


def edited(*replacements):
    text = EXAMPLE
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    return text


def problems(text, **changes):
    with pytest.raises(ScenarioError) as caught:
        loads(text, "two.toml", **changes)
    return [str(problem) for problem in caught.value.problems]


def start(system, name):
    return {key: instance.start[name] for key, instance in system.instances.items() if name in instance.start}


def test_the_default_preset_is_the_file_as_it_stands():
    assert loads(EXAMPLE, preset="nominal") == loads(EXAMPLE)
    assert loads(edited(('default_preset = "nominal"\n', ""), ('preset = "nominal"\n', ""))).provenance.preset is None


def test_a_preset_is_not_a_modification():
    system = loads(EXAMPLE, preset="mixed")
    assert (system.provenance.preset, system.provenance.modified, system.stepping.step) == ("mixed", False, 0.25)
    assert start(system, "speed") == {"train[1]": 80.0, "train[2]": 10}
    assert start(system, "beta") == {"cruise[1]": 0.1, "cruise[2]": 0.2}
    assert start(system, "sample_time") == {"cruise[1]": 0.5, "cruise[2]": 0.5}
    assert [system.instances[n].swapped for n in ("cruise[1]", "cruise[2]", "train[1]")] == [True, True, False]
    assert system.instances["cruise[1]"].model == "OtherCruise"
    assert system.instances["cruise[1]"].start["alpha"] == 0.03
    assert (system.instances["target"].build, system.instances["target"].start) == ({"points": 1}, {"values": 3.0})
    assert system.provenance.rescaled_from is None


@pytest.mark.parametrize(
    "changes",
    [
        {"settings": ["train[2].speed=10"]},
        {"settings": ["simulation.record=0.5"]},
        {"builds": ["target.points=3"]},
        {"swaps": ["cruise=Other"]},
        {"stop_time": 60},
        {"step": 0.25},
        {"algorithm": "jacobi"},
    ],
)
def test_anything_changed_beyond_the_preset_is_a_modification(changes):
    assert loads(EXAMPLE, **changes).provenance.modified
    assert loads(EXAMPLE, preset="gentle", **changes).provenance.modified


@pytest.mark.parametrize(
    "changes",
    [
        {"settings": ["train.speed=80"]},
        {"stop_time": 120},
        {"step": 0.5},
        {"algorithm": "gauss-seidel"},
        {"settings": []},
    ],
)
def test_a_change_to_the_same_value_is_none(changes):
    assert not loads(EXAMPLE, **changes).provenance.modified


@pytest.mark.parametrize("change", [{"step": 0.25}, {"settings": ["simulation.step=0.25"]}])
def test_sample_times_follow_the_step(change):
    system = loads(EXAMPLE, **change)
    assert (system.stepping.step, system.provenance.rescaled_from) == (0.25, 0.5)
    assert start(system, "sample_time") == {"cruise[1]": 0.25, "cruise[2]": 0.25}
    explicit = loads(EXAMPLE, step=0.25, settings=["cruise[1].sample_time=0.5"])
    assert start(explicit, "sample_time") == {"cruise[1]": 0.5, "cruise[2]": 0.25}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"preset": "gentel"}, "two.toml: there is no preset 'gentel'; did you mean 'gentle'?"),
        ({"preset": "zzz"}, "two.toml: there is no preset 'zzz'; there are nominal, gentle, mixed"),
        ({"settings": ["train"]}, "--set train: is not of the form name=value, as in --set train[4].speed=10"),
        ({"settings": ["=3"]}, "--set =3: is not of the form name=value, as in --set train[4].speed=10"),
        ({"settings": ["trian.speed=3"]}, "--set trian.speed=3: there is no instance 'trian'; did you mean 'train'?"),
        (
            {"settings": ["train[7].speed=3"]},
            "--set train[7].speed=3: there is no 'train[7]'; there are train[1] to train[2]",
        ),
        (
            {"settings": ["simulation.algorithm=jacoby"]},
            "--set simulation.algorithm=jacoby: there is no algorithm 'jacoby'",
        ),
        (
            {"settings": ["train.speed=[1]"]},
            "--set train.speed=[1]: speed has 1 value for the 2 instances of 'train'; ",
        ),
        ({"settings": ["train[1].count=3"]}, "--set train[1].count=3: a count belongs to all; write train.count"),
        ({"builds": ["train"]}, "--with train: is not of the form name=value, as in --with train.carriages=8"),
        ({"builds": ["carriages=8"]}, "--with carriages=8: there is no instance 'carriages'"),
        (
            {"swaps": ["cruise"]},
            "--swap cruise: is not of the form instance=model, as in --swap cruise=my_controller.py:My",
        ),
        ({"swaps": ["crise=X"]}, "--swap crise=X: there is no instance 'crise'; did you mean 'cruise'?"),
        (
            {"swaps": ["cruise.force=X"]},
            "--swap cruise.force=X: a swap replaces a whole instance; write --swap cruise=...",
        ),
        ({"swaps": ["cruise=gone.py:X"]}, "--swap cruise=gone.py:X: there is no file '"),
        ({"swaps": ["cruise=x.py"]}, "--swap cruise=x.py: 'x.py' does not name a class; write 'file.py:Class'"),
        ({"step": -1}, "--step -1: the step must be greater than 0 s, not -1 s"),
        ({"step": float("nan")}, "--step nan: takes a finite number, not nan"),
        (
            {"step": 0.7},
            "two.toml:5: simulation.stop_time: 120 s is not a whole number of steps of 0.7 s (--step 0.7); ",
        ),
        ({"stop_time": -5}, "--stop -5: the stop time, -5 s, must be later than the start, 0 s"),
        ({"algorithm": "euler"}, "--algorithm euler: there is no algorithm 'euler'; there are adaptive, gauss-seidel"),
    ],
)
def test_what_is_said_about_a_mistake_on_the_command_line(changes, message):
    found = problems(EXAMPLE, **changes)
    assert any(problem.startswith(message) for problem in found), found


FILES = '[simulation]\nstop_time = 1\n[instances.a]\ncomponent = "mine.py:A"\ncount = 2\n'
FILES += 'build = { n = 1, line = "line.json" }\n'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    for name in ("mine.py", "x.fmu", "line.json"):
        (tmp_path / "scenarios").mkdir(exist_ok=True)
        (tmp_path / "scenarios" / name).touch()
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_files_are_relative_to_the_scenario_and_on_the_command_line_to_where_one_is(folder):
    path = folder / "scenarios" / "s.toml"
    text = FILES + '[presets.other]\n"a.fmu" = "x.fmu"\n"a[1].build.line" = "line.json"\n'
    one = loads(text, path).instances["a[1]"]
    assert one.model == f"{folder}/scenarios/mine.py:A"
    assert one.build == {"n": 1, "line": f"{folder}/scenarios/line.json"}
    assert loads(text, path, preset="other").instances["a[1]"].model == f"{folder}/scenarios/x.fmu"
    changed = loads(text, path, swaps=["a[2]=mine.py:B"], builds=["a.line=line.json", "a[1].n=5"])
    assert [changed.instances[f"a[{k}]"].model for k in (1, 2)] == [
        f"{folder}/scenarios/mine.py:A",
        f"{folder}/mine.py:B",
    ]
    assert [changed.instances[f"a[{k}]"].swapped for k in (1, 2)] == [False, True]
    assert [changed.instances[f"a[{k}]"].build["n"] for k in (1, 2)] == [5, 1]
    assert changed.instances["a[2]"].build["line"] == f"{folder}/line.json"


def test_build_arguments_of_a_finished_fmu_are_what_is_given_for_it(folder):
    """Its structural parameters; what a swap leaves behind is none of them."""
    path = folder / "s.toml"
    assert loads(FILES, path, swaps=["a=x.fmu"]).instances["a[1]"].build == {}
    text = FILES.replace('component = "mine.py:A"', 'fmu = "x.fmu"')
    written = loads(FILES, path).instances["a[1]"].build
    assert loads(text, path).instances["a[1]"].build == written != {}
    assert loads(FILES, path, swaps=["a=x.fmu"], builds=["a.n=7"]).instances["a[1]"].build == {"n": 7}


def test_a_swap_for_the_same_model_is_none():
    system = loads(EXAMPLE, swaps=["cruise=ComfortCruise"])
    assert not system.provenance.modified
    assert not system.instances["cruise[1]"].swapped


def test_a_later_value_of_an_array_replaces_earlier_ones_of_its_elements():
    text = edited(("start.values = [85.0, 80.0]", 'start."values[1]" = 85.0'))
    assert loads(text, settings=["target.values=3"]).instances["target"].start == {"values": 3}
    made = loads(text, settings=["target.values=3", "target.values[2]=4"])
    assert made.instances["target"].start == {"values": 3, "values[2]": 4}
    one = loads(EXAMPLE, settings=["train[1].speed=5", "train.speed=6"])
    assert start(one, "speed") == {"train[1]": 6, "train[2]": 6}


def test_a_count_can_be_changed_where_the_lists_fit():
    made = loads(EXAMPLE, settings=["train.count=3", "cruise.count=3", "train.position=[3e4, 2e4, 0]"])
    assert start(made, "position") == {"train[1]": 3e4, "train[2]": 2e4, "train[3]": 0}
    assert len(made.connections) == 11
    singly = '[simulation]\nstop_time = 1\n[instances."a[1]"]\ncomponent = "A"\n'
    with pytest.raises(
        ScenarioError, match=r"--set a.count=2: the instances of 'a' are listed singly; there are only 1"
    ):
        loads(singly, settings=["a.count=2"])


def test_names_that_mean_something_else_are_reached_through_start():
    made = loads(EXAMPLE, settings=["cruise.start.count=7", "target.start.values=1", "target.start=2"])
    assert start(made, "count") == {"cruise[1]": 7, "cruise[2]": 7}
    assert made.instances["target"].start == {"values": 1, "start": 2}


@pytest.mark.parametrize(
    ("text", "value"),
    [("i > 1", "i > 1"), ("2020-01-01", "2020-01-01"), ("true", True), ('"7"', "7"), ("[1, 2]", 1), ("1e3", 1000.0)],
)
def test_values_are_toml_or_the_text_as_it_is(text, value):
    assert loads(EXAMPLE, settings=[f"train.x={text}"]).instances["train[1]"].start["x"] == value


def test_how_an_instance_steps_and_runs():
    changes = ["cruise.step=1.0", "cruise[2].step=2", "train.isolate=true", "train[1].isolate=false"]
    system = loads(EXAMPLE, settings=[*changes, "target.step_timeout=3", "target.memory_limit=100"])
    assert [one.step for one in system.instances.values()] == [None, None, 1.0, 2.0, None]
    assert [one.isolate for one in system.instances.values()] == [False, True, False, False, False]
    assert (system.instances["target"].step_timeout, system.instances["target"].memory_limit) == (3.0, 100.0)
    assert system.provenance.origins["instances.cruise[2].step"] == "--set cruise[2].step=2"
    assert system.provenance.modified
    text = EXAMPLE.replace('"cruise.alpha" = 0.01', '"cruise.step" = 1.0\ncruise.isolate = true')
    gentle = loads(text, "two.toml", preset="gentle").instances["cruise[1]"]
    assert (gentle.step, gentle.isolate, gentle.start.keys()) == (1.0, True, {"alpha", "has_ahead", "sample_time"})
    assert problems(EXAMPLE, settings=["cruise.step=[1, 2]", "train[2].isolate=1"]) == [
        "--set train[2].isolate=1: takes true or false, or 'together', not 1",
        "--set cruise.step=[1, 2]: takes a number greater than 0, in s, not [1, 2]",
    ]


def test_a_variable_that_is_called_like_an_option_is_reached_through_start():
    system = loads(EXAMPLE, settings=["cruise.start.step=1.0", "train[2].start.isolate=7", "target.step.size=3"])
    assert all(one.step is None and not one.isolate for one in system.instances.values())
    assert start(system, "step") == {"cruise[1]": 1.0, "cruise[2]": 1.0}
    assert start(system, "isolate") == {"train[2]": 7}
    assert start(system, "step.size") == {"target": 3}


def test_a_profile_may_be_a_table():
    text = edited(('"target.build.points" = 1', '"target.build" = { points = 1, profile = { a = [1, 2] } }'))
    assert loads(text, preset="mixed").instances["target"].build == {"points": 1, "profile": {"a": [1, 2]}}
    made = loads(EXAMPLE, builds=["target.profile={ a = 1 }"])
    assert made.instances["target"].build == {"points": 2, "profile": {"a": 1}}


def test_a_preset_says_what_it_is():
    text = 'description = "two trains"\n' + EXAMPLE.replace(
        "[presets.gentle]", '[presets.gentle]\ndescription = "gentler gains"'
    )
    for preset, said in ((None, "two trains"), ("nominal", "two trains"), ("gentle", "gentler gains"), ("mixed", "")):
        system = loads(text, preset=preset)
        assert system.provenance.description == said
        assert system.provenance.preset_descriptions == {"gentle": "gentler gains", "mixed": ""}
        assert loads(dump(system)).provenance.description == said
    with pytest.raises(ScenarioError, match=r"presets.gentle.description: takes a text, not 3"):
        loads(text.replace('"gentler gains"', "3"))


@pytest.mark.parametrize(
    ("text", "name", "value"),
    [
        ("target.'x = y'=3", "'x = y'", 3),
        ("target.'my var'=[1, 2]", "'my var'", [1, 2]),
        ("target.o'neil=it's", "o'neil", "it's"),
        ("target.k[0]=5", "k[0]", 5),
        ("target.m[1, 2]='a=b'", "m[1, 2]", "a=b"),
    ],
)
def test_names_of_other_makers(text, name, value):
    assert loads(EXAMPLE, settings=[text]).instances["target"].start[name] == value


def test_an_event_is_changed_by_its_place():
    settings = ["events[1].at=25.0", "events[1].value=-1", "events[1].every=15", "events[ 2 ].signal=train[2].force"]
    *biases, second = loads(EXAMPLE, settings=settings).events
    assert {(e.at, e.value, e.duration, e.every) for e in biases} == {(25.0, -1.0, 10.0, 15.0)}
    assert [e.signal for e in biases] == ["cruise[1].ahead_speed", "cruise[2].ahead_speed", "target.value"]
    assert (second.signal, second.at, second.origin) == (
        "train[2].force",
        60.0,
        "--set events[ 2 ].signal=train[2].force",
    )
    preset = edited(("[presets.gentle]", '[presets.gentle]\n"events[2].value" = 5'))
    assert loads(preset, preset="gentle").events[-1].value == 5
    assert loads(preset).events == loads(EXAMPLE).events
    assert loads(EXAMPLE, settings=["events[1].at=25"]).provenance.modified
    assert not loads(EXAMPLE, settings=["events[1].at=30"]).provenance.modified


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("events[3].at=1", "there is no events[3]; there are events[1] to events[2]"),
        ("events[0].at=1", "there is no events[0]; there are events[1] to events[2]"),
        ("events.at=1", "does not say which event; write events[1].at for the first"),
        ("events=1", "does not say which event; write events[1].at for the first"),
        ("events[1]=1", "names an event but not what to change; valid here: signal, action, at, value, rate, "),
        ("events[1].valeu=1", "an event has no 'valeu'; did you mean 'value'?"),
        ("events[1].at=soon", "takes a finite number, not 'soon'"),
        ("events[1].duration=-1", "takes a number greater than 0, in s, not -1"),
        ("events[1].duration=30", "the period, 20 s, must not be shorter than the duration, 30 s"),
        ("events[1].action=ramp", "rate is missing; say what is added in each second: rate = 0.1"),
        ("events[2].duration=1", "'set' takes no duration; what is set stays; take 'override' for a value that lasts"),
        ("events[1].signal=trian.speed", "there is no instance 'trian'; did you mean 'train'?"),
        ("events[1].signal=[]", 'takes "instance.variable", or a list of such texts, not []'),
    ],
)
def test_what_is_said_about_a_change_of_an_event(setting, message):
    found = problems(EXAMPLE, settings=[setting])
    assert any(message in problem for problem in found), found
    assert any(f"--set {setting}" in problem or "two.toml:" in problem for problem in found), found


def test_there_must_be_events_to_change():
    text = EXAMPLE[: EXAMPLE.index("[[events]]")]
    assert problems(text, settings=["events[1].at=3"]) == [
        "--set events[1].at=3: the scenario has no events; write one as [[events]]"
    ]
    one = text + '[[events]]\nsignal = "target.value"\naction = "freeze"\nat = 5.0\n'
    assert problems(one, settings=["events[2].at=3"]) == [
        "--set events[2].at=3: there is no events[2]; there is events[1]"
    ]
