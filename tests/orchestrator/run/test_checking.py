"""Everything that can be known to be wrong before a step is taken is said, all of it at once."""

import pytest
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.run import Results, run
from railcosim.orchestrator.run.checking import check
from railcosim.orchestrator.system import System


@pytest.fixture
def examine(workspace):
    return lambda system: check(system, workspace, "plain")


@pytest.fixture
def problems(examine):
    def find(system):
        with pytest.raises(ScenarioError) as caught:
            examine(system)
        return [str(problem) for problem in caught.value.problems]

    return find


def train(**how):
    system = System(**{"stop_time": 10.0, "step": 0.1} | how)
    system.add("train", "PointMassTrain", force=0.0)
    return system


def test_a_system_that_is_fit_to_run(examine):
    system = train()
    system.add("gust", "Gust")
    system.connect("gust.acceleration", "train.disturbance")
    checked = examine(system)
    assert checked.order.sequence == ("train", "gust")
    assert list(checked.models) == ["train", "gust"]
    assert len(checked.wiring.links) == 1
    assert checked.wiring.starts["train"] == {"force": 0.0}
    assert checked.notes == ()


@pytest.mark.parametrize(
    ("how", "expected"),
    [
        ({"step": 0.0}, "step must be a positive number, not 0.0 s"),
        ({"step": -0.1}, "step must be a positive number, not -0.1 s"),
        ({"step": float("nan")}, "step must be a positive number, not nan s"),
        ({"step": float("inf")}, "step must be a positive number, not inf s"),
        ({"stop_time": 0.0}, "stop_time 0.0 s must lie after start_time 0.0 s"),
        ({"stop_time": float("nan")}, "stop_time nan s must lie after start_time 0.0 s"),
        ({"stop_time": float("inf")}, "stop_time inf s must lie after start_time 0.0 s"),
        ({"start_time": 20.0}, "stop_time 10.0 s must lie after start_time 20.0 s"),
        ({"stop_time": 10.05}, "stop_time = 10.05 s is not a whole multiple of step = 0.1 s"),
        ({"stop_time": 0.04}, "stop_time = 0.04 s is not a whole multiple of step = 0.1 s"),
        ({"start_time": 0.05}, "stop_time - start_time = 9.95 s is not a whole multiple of step = 0.1 s"),
        ({"record": 0.25}, "record = 0.25 s is not a whole multiple of step = 0.1 s"),
        ({"stop_time": 1e300}, "stop_time = 1e+300 s is 1e+301 steps of 0.1 s: too many to count"),
        ({"record": 1e300}, "record = 1e+300 s is 1e+301 steps of 0.1 s: too many to count"),
        ({"record": 0.0}, "record = 0 s is not a whole multiple of step = 0.1 s"),
        ({"record": -0.5}, "record = -0.5 s is not a whole multiple of step = 0.1 s"),
        ({"record": float("nan")}, "record = nan s is not a whole multiple of step = 0.1 s"),
        ({"algorithm": "gaus-seidel"}, "algorithm 'gaus-seidel' is unknown; did you mean 'gauss-seidel'?"),
        ({"order": ["trian"]}, "order: there is no instance 'trian'; did you mean 'train'?"),
        ({"order": ["train", "train"]}, "order: 'train' stands twice"),
    ],
)
def test_simulation_settings(problems, how, expected):
    assert expected in problems(train(**how))


@pytest.mark.parametrize(
    ("stop", "step", "record"), [(1.0, 1 / 3, 1 / 3), (350.0, 0.1, 0.5), (0.3, 0.1, None), (1e5, 1e-3, 1.0)]
)
def test_multiples_up_to_rounding(examine, stop, step, record):
    examine(train(stop_time=stop, step=step, record=record))


def test_an_order_must_name_everything(problems):
    system = train(order=["train"])
    system.add("gust", "Gust")
    assert problems(system) == ["order: 'gust' is missing"]


def test_no_instances(problems):
    assert "the system has no instances" in problems(System())


def test_all_kinds_of_problems_together(problems):
    """Settings, start values, connections, requirements, metrics and figures."""
    system = train(step=0.3)
    system.instances["train"].start["mas"] = 1.0
    system.connect("train.speed", "train.frce")
    system.judged.requirements["slow"] = "always train.sped < 3"
    system.judged.metrics["top"] = "max(train.spede)"
    system.judged.figures.append({"title": "Speed", "y": ["train.sepeed"]})
    found = problems(system)
    named = ["stop_time", "train.mas", "frce", "train.sped", "train.spede", "train.sepeed"]
    assert len(found) == len(named)
    assert all(word in text for word, text in zip(named, found, strict=True))


def test_missing_models_and_wrong_settings_together(problems):
    system = train(step=-1.0)
    system.add("gust", "Gusst")
    found = problems(system)
    assert len(found) == 2
    assert "did you mean 'Gust'?" in found[1]


def test_an_fmu_that_can_be_instantiated_only_once(problems, examine, foreign, xml):
    path = foreign([xml["variable"]("y", "output")], simulation='canBeInstantiatedOnlyOncePerProcess="true"')
    system = System()
    system.add("a", path)
    system.add("b", path)
    said = "a, b: this FMU can be instantiated only once per process; give all but one of them a process of its own by "
    assert problems(system) == [f"{said}isolate = true"]
    system.instances["b"].isolate = True
    examine(system)


def test_notes(examine, foreign, xml):
    """What a user should know of another maker's FMU, once, however often it stands there."""
    v = xml["variable"]
    path = foreign(
        [v("u", "input", start=2.0), v("y", "output"), v("odd", "output", unit="furlong")],
        simulation='needsExecutionTool="true"',
    )
    system = System(order=["a", "b", "gust"])
    system.add("a", path)
    system.add("b", path, u=1.0)
    system.add("gust", "Gust")
    system.connect("gust.acceleration", "a.u")
    notes = examine(system).notes
    assert sum("furlong" in note for note in notes) == 1
    assert "Foreign lists no dependencies of y, odd; no direct feed-through is assumed" in notes
    assert "Foreign says that it needs the tool it was made with (PythonFMU by hand)" in notes
    assert len(notes) == len(set(notes))


def test_what_the_order_cannot_serve_is_noted_where_there_is_an_order(examine):
    system = train(order=["gust", "train"])
    system.add("gust", "Gust")
    system.connect("gust.acceleration", "train.disturbance")
    late = "train.disturbance receives gust.acceleration of the end of the step instead of its begin"
    assert examine(system).notes[0].startswith(late)
    system.stepping.algorithm = "jacobi"
    assert examine(system).notes == ()


def test_problems_say_where_they_were_written(problems):
    system = train()
    system.instances["train"].origin = "line.toml:12"
    system.instances["train"].start["mas"] = 1.0
    assert problems(system)[0].startswith("line.toml:12: train.mas: PointMassTrain has no such variable")


def test_requirements_read_what_a_swap_left(examine, tmp_path):
    """A scenario's bounds outlive the controller that had them; a model that is no swap must have them."""
    system = train(
        stop_time=1.0, requirements={"slow": "always train.speed <= train.bounds[2] outside [0, train.late]"}
    )
    system.instances["train"].swapped = True
    system.instances["train"].start |= {"speed": 20.0, "bounds": [10, 30.0], "late": 0.5, "word": "i > 1"}
    checked = examine(system)
    assert checked.wiring.left == {"train.bounds[1]": 10, "train.bounds[2]": 30.0, "train.late": 0.5}
    assert checked.system.judged.requirements == system.judged.requirements
    outcome = run(system, kind="plain", output=tmp_path)
    assert [(verdict.verdict, verdict.points) for verdict in outcome.requirements] == [("pass", 5)]
    assert Results.load(tmp_path).parameters["train.bounds[2]"] == 30.0


def test_a_window_does_not_hang_on_a_signal(problems):
    system = train(requirements={"slow": "always train.speed <= 30 from train.position"})
    assert problems(system) == ["requirement 'slow': 'train.position': a time is a number or a parameter, not a signal"]
