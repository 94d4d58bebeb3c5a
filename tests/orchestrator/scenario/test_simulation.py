"""`[simulation]`: values, tolerances of single signals, presets and changes; every message read."""

import pytest
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.scenario.loading import loads
from railcosim.orchestrator.system import System

TEXT = """[simulation]
stop_time = 10.0
step = 0.5

[instances.mass]
component = "A"

[instances.train]
component = "B"
count = 3
"""


def simulation(*lines):
    return TEXT.replace("step = 0.5\n", "step = 0.5\n" + "\n".join(lines) + "\n")


def problems(text, **changes):
    with pytest.raises(ScenarioError) as caught:
        loads(text, "x.toml", **changes)
    return [str(problem) for problem in caught.value.problems]


def test_without_a_word_the_values_are_those_of_a_system():
    system, other = loads(TEXT), System()
    keys = ("extrapolation", "algebraic_loops", "refresh", "unsettled", "tolerance", "tolerances", "max_iterations")
    for key in (*keys, "relaxation", "acceleration", "min_step"):
        assert getattr(system.stepping, key) == getattr(other.stepping, key), key
    assert system.events == other.events


@pytest.mark.parametrize(
    ("key", "text", "value"),
    [
        ("extrapolation", "2", 2),
        ("algebraic_loops", '"solve"', "solve"),
        ("refresh", "true", True),
        ("unsettled", '"go-on"', "go-on"),
        ("tolerance", "1e-6", 1e-6),
        ("max_iterations", "1", 1),
        ("relaxation", "2", 2.0),
        ("acceleration", '"aitken"', "aitken"),
        ("min_step", "0.5", 0.5),
        ("algorithm", '"iterative"', "iterative"),
        ("algorithm", '"adaptive"', "adaptive"),
    ],
)
def test_a_value_in_the_file_in_a_preset_and_on_the_command_line(key, text, value):
    assert getattr(loads(simulation(f"{key} = {text}")).stepping, key) == value
    preset = TEXT + f'[presets.other]\n"simulation.{key}" = {text}\n'
    assert getattr(loads(preset, preset="other").stepping, key) == value
    assert getattr(loads(preset).stepping, key) != value
    changed = loads(TEXT, settings=[f"simulation.{key}={text}"])
    assert (getattr(changed.stepping, key), changed.provenance.modified) == (value, True)
    assert changed.provenance.origins[f"simulation.{key}"] == f"--set simulation.{key}={text}"


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (
            "extrapolation = 3",
            "extrapolation: takes 0, 1 or 2, the order of the polynomial by which inputs are continued, not 3",
        ),
        (
            "extrapolation = true",
            "extrapolation: takes 0, 1 or 2, the order of the polynomial by which inputs are continued, not true",
        ),
        (
            'algebraic_loops = "slove"',
            "algebraic_loops: there is no treatment of algebraic loops 'slove'; did you mean 'solve'?",
        ),
        (
            "algebraic_loops = true",
            "algebraic_loops: there is no treatment of algebraic loops true; there are delay, solve",
        ),
        ("tolerance = 0", "tolerance: takes a number greater than 0 and less than 1, not 0"),
        ("tolerance = 1", "tolerance: takes a number greater than 0 and less than 1, not 1"),
        ("tolerance = nan", "tolerance: takes a number greater than 0 and less than 1, not nan"),
        ("tolerence = 1e-3", "tolerence: unknown key 'tolerence'; did you mean 'tolerance'?"),
        ("max_iterations = 0", "max_iterations: takes a whole number, at least 1, not 0"),
        ("max_iterations = 2.0", "max_iterations: takes a whole number, at least 1, not 2.0"),
        ("relaxation = 0.0", "relaxation: takes a number greater than 0 and at most 2, not 0.0"),
        ("relaxation = 2.1", "relaxation: takes a number greater than 0 and at most 2, not 2.1"),
        ('acceleration = "Aitken"', "acceleration: there is no acceleration 'Aitken'; did you mean 'aitken'?"),
        ('acceleration = "fast"', "acceleration: there is no acceleration 'fast'; there are none, aitken, anderson"),
        ("min_step = 0", "min_step: takes a number greater than 0, in s, not 0"),
        ("min_step = 0.6", "min_step: the shortest step, 0.6 s, must not be longer than the step, 0.5 s (x.toml:3)"),
        ("tolerances = 3", "tolerances: is a table, [simulation.tolerances], not 3"),
    ],
)
def test_what_is_said_about_a_mistake(line, message):
    assert problems(simulation(line)) == [f"x.toml:4: simulation.{message}"]


def test_the_shortest_step_is_compared_with_the_step_there_is():
    text = simulation("min_step = 0.2")
    assert problems(text, step=0.1) == [
        "x.toml:4: simulation.min_step: the shortest step, 0.2 s, must not be longer than the step, 0.1 s (--step 0.1)"
    ]
    assert problems(text.replace("step = 0.5\n", "", 1)) == [
        "x.toml:3: simulation.min_step: the shortest step, 0.2 s, must not be longer than the step, 0.1 s"
    ]


def test_steps_of_variable_length_need_no_grid():
    text = simulation('algorithm = "adaptive"', "record = 0.03").replace("stop_time = 10.0", "stop_time = 10.123")
    assert (loads(text).stepping.record, loads(text).stepping.stop_time) == (0.03, 10.123)
    assert [problem.partition(": ")[0] for problem in problems(text, algorithm="jacobi")] == ["x.toml:2", "x.toml:5"]
    assert problems(text.replace("0.03", "0")) == [
        "x.toml:5: simulation.record: the distance of rows must be greater than 0 s, not 0 s"
    ]


# -------------------------------------------------------------------- tolerances of single signals


def test_tolerances_of_all_of_a_name_of_one_and_of_names_without_quotes():
    system = loads(
        simulation(
            "[simulation.tolerances]",
            '"train[2].speed" = [0, 0.1]',
            '"train.speed" = [1e-3, 0]',
            "mass.position = [1e-6, 1e-3]",
            '"train[1].force[ 2 ]" = [1, 1]',
        ),
        "x.toml",
    )
    assert system.stepping.tolerances == {
        "train[1].speed": [1e-3, 0.0],
        "train[2].speed": [0.0, 0.1],
        "train[3].speed": [1e-3, 0.0],
        "mass.position": [1e-6, 1e-3],
        "train[1].force[2]": [1.0, 1.0],
    }
    assert system.provenance.origins["simulation.tolerances.train[2].speed"] == "x.toml:5"
    assert system.provenance.origins["simulation.tolerances.train[3].speed"] == "x.toml:6"
    assert system.provenance.origins["simulation.tolerances.mass.position"] == "x.toml:7"


TOLERANCES = simulation("[simulation.tolerances]", '"train[2].speed" = [0, 0.1]', '"mass.x[1]" = [0.5, 0]')


@pytest.mark.parametrize(
    ("setting", "line", "changed"),
    [
        ("train[2].speed=[0, 3]", '"train[2].speed" = [0, 3]', {"train[2].speed": [0.0, 3.0]}),
        (
            "train.speed=[0, 3]",
            '"train.speed" = [0, 3]',
            {f"train[{k}].speed": [0.0, 3.0] for k in (1, 2, 3)},
        ),
        ("mass.x=[0, 3]", "mass.x = [0, 3]", {"mass.x[1]": None, "mass.x": [0.0, 3.0]}),
        ("mass.xy=[0, 3]", "mass.xy = [0, 3]", {"mass.xy": [0.0, 3.0]}),
    ],
)
def test_what_comes_later_wins_all_over_one_and_arrays_over_elements(setting, line, changed):
    made = {"train[2].speed": [0.0, 0.1], "mass.x[1]": [0.5, 0.0]} | changed
    expected = {name: pair for name, pair in made.items() if pair is not None}
    assert loads(TOLERANCES, settings=[f"simulation.tolerances.{setting}"]).stepping.tolerances == expected
    for key in ("[presets.other.simulation.tolerances]\n", '[presets.other."simulation.tolerances"]\n'):
        assert loads(f"{TOLERANCES}{key}{line}\n", preset="other").stepping.tolerances == expected
    name, _, value = setting.partition("=")
    table = f'simulation.tolerances={{ "{name}" = {value} }}'
    assert loads(TOLERANCES, settings=[table]).stepping.tolerances == expected


@pytest.mark.parametrize(
    ("line", "message"),
    [
        *(
            (f'"mass.x" = {value}', f'"mass.x": takes [relative, absolute], two numbers from 0 and not both 0, not {s}')
            for value, s in {
                "1e-3": "0.001",
                "[1e-3]": "[0.001]",
                "[0, 0]": "[0, 0]",
                "[-1, 1]": "[-1, 1]",
                "[1, inf]": "[1, inf]",
                "[true, 1]": "[True, 1]",
                '"1e-3"': "'1e-3'",
            }.items()
        ),
        ('"mas.x" = [1, 1]', "\"mas.x\": there is no instance 'mas'; did you mean 'mass'?"),
        (
            "mass = [1, 1]",
            "mass: 'mass' is not of the form instance.variable, as in train[4].speed or train.speed; "
            "instances are mass, train",
        ),
        (
            '"train[i].x" = [1, 1]',
            "\"train[i].x\": 'train[i].x': i has no meaning here; write train.x for all or train[1].x for one",
        ),
        ('"train[4].x" = [1, 1]', "\"train[4].x\": there is no 'train[4]'; there are train[1] to train[3]"),
    ],
)
def test_what_is_said_about_a_wrong_tolerance(line, message):
    assert problems(simulation("[simulation.tolerances]", line)) == [f"x.toml:5: simulation.tolerances.{message}"]


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        (
            "=3",
            "is a table, not 3; write simulation.tolerances.INSTANCE.VARIABLE = [relative, absolute]",
        ),
        (".mas.x=[1, 1]", "there is no instance 'mas'; did you mean 'mass'?"),
        (".mass.x=1", "takes [relative, absolute], two numbers from 0 and not both 0, not 1"),
    ],
)
def test_what_is_said_about_a_wrong_tolerance_on_the_command_line(setting, message):
    text = f"simulation.tolerances{setting}"
    assert problems(TEXT, settings=[text]) == [f"--set {text}: {message}"]


def test_a_mistake_in_a_preset_is_told_also_when_another_one_runs():
    assert problems(TEXT + '[presets.other]\n"simulation.tolerances.mass.x" = 3\n"simulation.relaxation" = 3\n') == [
        'x.toml:13: presets.other."simulation.relaxation": takes a number greater than 0 and at most 2, not 3',
        'x.toml:12: presets.other."simulation.tolerances.mass.x": '
        "takes [relative, absolute], two numbers from 0 and not both 0, not 3",
    ]


def test_a_step_too_short_for_its_times_is_told():
    text = TEXT.replace("stop_time = 10.0\nstep = 0.5", "start_time = 1.7e9\nstop_time = 1700000000.00001\nstep = 1e-7")
    assert problems(text) == [
        "x.toml:3: simulation.stop_time: points that are 1e-07 s apart cannot be told apart at such times; "
        "begin nearer to 0 s (simulation.start_time)"
    ]
