"""What is said about every mistake in a scenario file."""

from pathlib import Path

import pytest
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.figures import check_figures
from railcosim.orchestrator.scenario.loading import loads

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


MISTAKES = [
    ("step = 0.5", "stepp = 0.5", "two.toml:6: simulation.stepp: unknown key 'stepp'; did you mean 'step'?"),
    ("title =", "ttle =", "two.toml:1: ttle: unknown key 'ttle'; did you mean 'title'?"),
    ('title = "Two trains"', "title = 3", "two.toml:1: title: takes a text, not 3"),
    ("[require]", "[reqire]", "two.toml:42: reqire: unknown key 'reqire'; did you mean 'require'?"),
    ("step = 0.5", "step = 0", "two.toml:6: simulation.step: the step must be greater than 0 s, not 0 s"),
    ("step = 0.5", "step = true", "two.toml:6: simulation.step: takes a finite number, not true"),
    ("step = 0.5", 'step = "fast"', "two.toml:6: simulation.step: takes a finite number, not 'fast'"),
    ("stop_time = 120.0", "stop_time = inf", "two.toml:5: simulation.stop_time: takes a finite number, not inf"),
    (
        "stop_time = 120.0",
        "",
        "two.toml: simulation.stop_time is missing; say how long to run, in s: stop_time = 350.0",
    ),
    (
        "stop_time = 120.0",
        "stop_time = 10.0\nstart_time = 10",
        "two.toml:5: simulation.stop_time: the stop time, 10 s, must be later than the start, 10 s",
    ),
    (
        "stop_time = 120.0",
        "stop_time = 120.2",
        "two.toml:5: simulation.stop_time: 120.2 s is not a whole number of steps of 0.5 s (two.toml:6); "
        "change the step, or stop at 120 s or 120.5 s",
    ),
    (
        "record = 1.0",
        "record = 0.7",
        "two.toml:7: simulation.record: 0.7 s is not a whole number of steps of 0.5 s (two.toml:6); "
        "take 0.5 s (simulation.record)",
    ),
    (
        "record = 1.0",
        'algorithm = "jacoby"',
        "two.toml:7: simulation.algorithm: there is no algorithm 'jacoby'; did you mean 'jacobi'?",
    ),
    (
        "record = 1.0",
        "algorithm = 3",
        "two.toml:7: simulation.algorithm: there is no algorithm 3; there are adaptive, gauss-seidel",
    ),
    (
        "record = 1.0",
        'algorithm = ["jacobi"]',
        "two.toml:7: simulation.algorithm: there is no algorithm ['jacobi']; did you mean 'jacobi'?",
    ),
    ("record = 1.0", "seed = 1.5", "two.toml:7: simulation.seed: takes a whole number from 0 to 2**63 - 1, not 1.5"),
    ("record = 1.0", "seed = -1", "two.toml:7: simulation.seed: takes a whole number from 0 to 2**63 - 1, not -1"),
    (
        "record = 1.0",
        'order = "cruise"',
        'two.toml:7: simulation.order: is a list of instance names, as in ["cruise", "train", "gust"]',
    ),
    (
        "record = 1.0",
        'order = ["cruise", "trian", "target", "train"]',
        "two.toml:7: simulation.order: there is no instance 'trian'; did you mean 'train'?",
    ),
    (
        "record = 1.0",
        'order = ["cruise", "train", "cruise[1]", "target"]',
        "two.toml:7: simulation.order: 'cruise[1]' stands there twice; each instance steps once",
    ),
    (
        "record = 1.0",
        'order = ["cruise", "train[1]"]',
        "two.toml:7: simulation.order: lacks train[2], target; name every instance, or leave order out",
    ),
    (
        "count = 2\nstart.p",
        "coutn = 2\nstart.p",
        "two.toml:11: instances.train.coutn: unknown key 'coutn'; did you mean 'count'?",
    ),
    (
        "count = 2\nstart.p",
        "count = 0\nstart.p",
        "two.toml:11: instances.train.count: takes a whole number from 1 to 10000, not 0",
    ),
    *(
        ("start.speed = 80.0", f"{key} = {value}", f"two.toml:13: instances.train.{key}: {message}")
        for key, value, message in (
            ("step", "0", "takes a number greater than 0, in s, not 0"),
            ("step", "[0.5, 1.0]", "takes a number greater than 0, in s, not [0.5, 1.0]"),
            ("isolate", '"yes"', "takes true or false, or 'together', not 'yes'"),
            ("step_timeout", "-1.0", "takes a number greater than 0, in s, not -1.0"),
            ("memory_limit", '"1 GB"', "takes a number greater than 0, in MiB, not '1 GB'"),
            ("swapped", "1", "takes true or false, not 1"),
            ("isolated", "true", "unknown key 'isolated'; did you mean 'isolate'?"),
        )
    ),
    (
        "[instances.target]",
        '[instances."train[2]"]\nmemory_limit = 0\n[instances.target]',
        'two.toml:21: instances."train[2]".memory_limit: takes a number greater than 0, in MiB, not 0',
    ),
    ("[require]", "[[event]]\nat = 1\n[require]", "two.toml:42: event: unknown key 'event'; did you mean 'events'?"),
    (
        "start.position = [17e3, 0.0]",
        "start.position = [17e3]",
        "two.toml:12: instances.train.start.position: position has 1 value for the 2 instances of 'train'; "
        "give one for each, or a single value for all",
    ),
    (
        "start.speed = 80.0",
        "start.speed = 1979-05-27",
        "two.toml:13: instances.train.start.speed: takes numbers, texts, true or false, or lists of these, "
        "not datetime.date(1979, 5, 27)",
    ),
    (
        "build = { points = 2 }",
        "build = { points = 1979-05-27 }",
        "two.toml:22: instances.target.build.points: takes numbers, texts, true or false, lists and tables of these; "
        "quote a date",
    ),
    (
        "build = { points = 2 }",
        "build = 2",
        "two.toml:22: instances.target.build: is a table, [instances.target.build], not 2",
    ),
    (
        'component = "Schedule"\n',
        "",
        "two.toml:20: instances.target: says neither component = ... nor fmu = ...; name the model",
    ),
    (
        'component = "Schedule"',
        'component = "Schedule"\nfmu = "x.fmu"',
        "two.toml:22: instances.target.fmu: component and fmu exclude each other; keep one",
    ),
    (
        'component = "Schedule"',
        'component = "x.fmu"',
        "two.toml:21: instances.target.component: 'x.fmu' is an FMU file; write fmu = ... instead of component = ...",
    ),
    (
        "[instances.target]",
        '[instances."my target"]',
        'two.toml:20: instances."my target": an instance\'s name takes letters, digits and _, not first a digit; '
        "choose another for 'my target'",
    ),
    (
        "[instances.target]",
        "[instances.metrics]",
        "two.toml:20: instances.metrics: an instance's name is taken; choose another for 'metrics'",
    ),
    (
        "[instances.target]",
        '[instances."train[3]"]\ncomponent = "A"\n[instances.target]',
        "two.toml:20: instances.\"train[3]\": 'train' has a count of 2, so there is no train[3]",
    ),
    (
        "[instances.target]",
        '[instances."class[1]"]\ncomponent = "A"\n[instances.target]',
        "two.toml:20: instances.\"class[1]\": an instance's name is taken; choose another for 'class'",
    ),
    (
        "[instances.target]",
        '[instances."x[1]"]\nstart.speed = 1.0\n[instances.target]',
        'two.toml:20: instances."x[1]": says neither component = ... nor fmu = ...; name the model',
    ),
    (
        "[instances.target]",
        '[instances."x[2]"]\ncomponent = "A"\n[instances.target]',
        'two.toml:20: instances."x[2]": there is no x[1]; number from 1 without gaps',
    ),
    (
        '"cruise[i].speed" = "train[i].speed"',
        '"cruise[i].speed" = 3',
        'two.toml:26: connections."cruise[i].speed": '
        'takes "instance.output" or { from = "instance.output", ... }, not 3',
    ),
    (
        "delay = 1",
        "dely = 1",
        "two.toml:29: connections.\"train[i].force\".dely: unknown key 'dely'; did you mean 'delay'?",
    ),
    (
        "delay = 1",
        "delay = -1",
        'two.toml:29: connections."train[i].force".delay: '
        "takes a whole number of communication steps, at least 0, not -1",
    ),
    (
        "scale = 2",
        "scale = nan",
        'two.toml:28: connections."cruise[i].target_speed".scale: takes a finite number, not nan',
    ),
    (
        "scale = 2",
        'threshold = "high"',
        "two.toml:28: connections.\"cruise[i].target_speed\".threshold: takes a finite number, not 'high'",
    ),
    (
        "scale = 2",
        "convert = 1",
        'two.toml:28: connections."cruise[i].target_speed".convert: takes true or false, not 1',
    ),
    (
        "scale = 2",
        "map = { a = 1.5 }",
        'two.toml:28: connections."cruise[i].target_speed".map: takes a table of what becomes of which value, '
        "not {'a': 1.5}; as in",
    ),
    (
        "scale = 2",
        "optional = 1",
        'two.toml:28: connections."cruise[i].target_speed".optional: takes true or false, not 1',
    ),
    (
        'from = "target.value", ',
        "",
        'two.toml:28: connections."cruise[i].target_speed": names no source; write { from = "instance.output", ... }',
    ),
    (
        '"train[i-1].speed"',
        '"trian[i-1].speed"',
        "two.toml:27: connections.\"cruise[i].ahead_speed\": there is no instance 'trian'; did you mean 'train'?",
    ),
    (
        '"train[i-1].speed"',
        '"train[i-7].speed"',
        'two.toml:27: connections."cruise[i].ahead_speed": there is no i for which both ends exist; '
        "counts are: cruise 2, train 2",
    ),
    (
        'default_preset = "nominal"',
        'default_preset = "gentle"',
        "two.toml:2: default_preset: names the values as they stand, but there is [presets.gentle] as well; "
        "rename one of the two",
    ),
    (
        '[presets.gentle]\n"cruise.alpha" = 0.01',
        "[presets]\ngentle = 3",
        "two.toml:32: presets.gentle: is a table, not 3",
    ),
    (
        '"cruise.alpha" = 0.01',
        '"crise.alpha" = 0.01',
        "two.toml:32: presets.gentle.\"crise.alpha\": there is no instance 'crise'; did you mean 'cruise'?",
    ),
    (
        '"cruise.alpha" = 0.01',
        '"cruise[3].alpha" = 0.01',
        "two.toml:32: presets.gentle.\"cruise[3].alpha\": there is no 'cruise[3]'; there are cruise[1] to cruise[2]",
    ),
    (
        '"cruise.alpha" = 0.01',
        '"cruise[i].alpha" = 0.01',
        "two.toml:32: presets.gentle.\"cruise[i].alpha\": 'cruise[i].alpha': i has no meaning here; "
        "write cruise for all or cruise[1] for one",
    ),
    (
        '"cruise.alpha" = 0.01',
        '"cruise" = 0.01',
        "two.toml:32: presets.gentle.cruise: names an instance but not what to change; "
        "write cruise.VARIABLE or cruise.component",
    ),
    (
        '"cruise.alpha" = 0.01',
        '"simulation.stp" = 0.01',
        "two.toml:32: presets.gentle.\"simulation.stp\": unknown key 'simulation.stp'; did you mean 'step'?",
    ),
    (
        '"cruise.alpha" = 0.01',
        '"simulation.step" = 0.7',
        "two.toml:5: simulation.stop_time: 120 s is not a whole number of steps of 0.7 s (two.toml:32); "
        "change the step, or stop at 119.7 s or 120.4 s",
    ),
    (
        '"cruise.alpha" = 0.01',
        '"cruise.alpha" = [1, 2, 3]',
        "two.toml:32: presets.gentle.\"cruise.alpha\": alpha has 3 values for the 2 instances of 'cruise'; "
        "give one for each, or a single value for all",
    ),
    (
        '"cruise.alpha" = 0.01',
        '"cruise.alpha" = 1979-05-27',
        'two.toml:32: presets.gentle."cruise.alpha": takes numbers, texts, true or false, or lists of these, not ',
    ),
    (
        '"cruise.alpha" = 0.01',
        '"target.count" = 2',
        "two.toml:32: presets.gentle.\"target.count\": 'target' has no count to change; "
        "give it one in [instances.target]",
    ),
    (
        '"cruise.alpha" = 0.01',
        '"cruise.component" = 7',
        "two.toml:32: presets.gentle.\"cruise.component\": takes a text: a component's name, 'file.py:Class', "
        "or the path of an .fmu",
    ),
    (
        "always abs",
        "alway abs",
        "two.toml:43: require.comfort: 'alway abs(train[i].acceleration) <= 1.0' does not say when",
    ),
    ('comfort = "', 'comfort = 3 # "', "two.toml:43: require.comfort: takes a text, not 3"),
    (
        '"settling_time(train',
        '"settling_time((train',
        "two.toml:46: metrics.settling: 'settling_time((train[:].speed - target.value, 1.0)', column 14: '(' was never",
    ),
    (
        "tolerance = 1",
        "tolerence = 1",
        "two.toml:53: references[1].tolerence: unknown key 'tolerence'; did you mean 'tolerance'?",
    ),
    (
        '\npreset = "nominal"',
        '\npreset = "nominall"',
        "two.toml:51: references[1].preset: unknown preset 'nominall'; did you mean 'nominal'?",
    ),
    (
        'metric = "gap[2]"',
        'metric = "gp[2]"',
        "two.toml:57: published[1].metric: unknown metric 'gp'; did you mean 'gap'?",
    ),
    ('origin = "stated"', 'origin = "sated"', "two.toml:60: published[1].origin: origin must be one of stated,"),
    (
        'origin = "stated"',
        'origin = "stated"\nstatus = "measured"',
        "two.toml:61: published[1].status: unknown key 'status'; origin = one of stated, fitted, ",
    ),
    (
        'where = "own integration"',
        'origin = "reference"',
        "two.toml:54: references[1].origin: unknown key 'origin'; a value of one's own has none",
    ),
    ('y = ["train', 'z = ["train', "two.toml:64: figures[1].z: unknown key 'z'; valid here: title, y, x, label, "),
    ('"target.value"]', '"target.value +"]', "two.toml:64: figures[1].y: 'target.value +', column 1: invalid syntax"),
    ('"target.value"]', "3]", "two.toml:64: figures[1].y: takes expressions, texts, not 3"),
    (
        '"target.value"]',
        '"target.value"]\nx_range = [0, 2024-01-01]',
        "two.toml:62: figures[1]: takes numbers, texts, true or false, lists and tables of these; no dates",
    ),
    ("[[figures]]", "[figures]", "two.toml:62: figures: is a list of tables; each begins with [[figures]]"),
]


@pytest.mark.parametrize(("old", "new", "message"), MISTAKES, ids=lambda text: text[:40])
def test_what_is_said_about_a_mistake(old, new, message):
    found = problems(edited((old, new)))
    assert any(problem.startswith(message) for problem in found), found


def test_all_problems_are_told_at_once_and_each_only_once():
    text = edited(
        ("step = 0.5", "step = 0.5\nstpe = 1"), ('"train[i-1].speed"', '"tran[i-1].speed"'), ("always", "alwys")
    )
    found = problems(text, preset="gentel", settings=["cruse.alpha=1"], swaps=["target"], builds=["x.y=1"])
    assert len(found) == len(set(found)) == 7


def test_a_preset_nobody_defined_is_told_once_for_all_published_values():
    text = edited(('default_preset = "nominal"\n', ""))
    text += '\n[[published]]\nmetric = "settling"\npreset = "nominal"\nclaim = "x"\norigin = "stated"\n'
    assert len([p for p in problems(text) if "nominal" in p]) == 1


def test_a_connection_without_quotes_is_one():
    """A dotted key of TOML is a table in a table."""
    quoted, plain = (
        loads(edited(("[presets.gentle]", f'{key} = "train[1].speed"\n[presets.gentle]')))
        for key in ('"target.gain"', "target.gain")
    )
    assert quoted.connections[-1].target == "target.gain"
    assert plain.connections == quoted.connections


def test_a_panel_that_is_no_table_is_left_to_those_who_draw():
    system = loads(edited(('y = ["train[:].speed", "target.value"]', "panels = [3]")))
    (problem,) = check_figures(system.judged.figures, [])
    assert str(problem).endswith("panels must be a list of tables, each with y")


def test_no_instances():
    assert "two.toml: there are no instances; begin one with [instances.NAME]" in problems(
        "[simulation]\nstop_time = 1"
    )
    assert problems("instances = 3\n[simulation]\nstop_time = 1") == [
        "two.toml:1: instances: is a table, [instances], not 3"
    ]
