"""A scenario packed as one FMU: what it shows, what it computes, and what is refused."""

import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from railcosim.fmus.build import build, native_problem
from railcosim.fmus.references import resolve
from railcosim.orchestrator import Event, RailcosimError, ScenarioError, System, load, run
from railcosim.orchestrator.cli.app import call
from railcosim.orchestrator.packing.container import pack
from railcosim.orchestrator.packing.exposure import Exposed, select
from railcosim.orchestrator.system import Connection

pytest.importorskip("fmu_manipulation_toolbox")
pytestmark = pytest.mark.skipif(
    bool(native_problem(resolve("PointMassTrain"))), reason="native FMUs cannot be made here"
)

KINDS = '''class Kinds(Component):
    """Every type a container may hand on, scalars and arrays."""

    size = Parameter("1", 3, type=int, description="factor")
    flag = Parameter("1", True, description="adds one")
    x = State("m", 0.5, shape=(3,), output=True, description="states")
    u = Input("m", shape=(3,), description="what the states follow")
    n = Input("1", 0, type=int, optional=True, description="a number")
    b = Input("1", False, optional=True, description="a truth")
    more = Output("1", int, description="size times n")
    odd = Output("1", bool, description="not b")
    y = Output("m", shape=(3,), description="straight through, with the states")

    def derivatives(self):
        return {"x": [self.u[0] - self.x[0], 2.0 * (self.u[1] - self.x[1]), self.u[2] - 0.1 * self.x[2]]}

    def outputs(self):
        more = self.n * self.size + maths.where(self.flag, 1, 0)
        return {"more": more, "odd": maths.logical_not(self.b), "y": 2.0 * self.u + self.x}
'''


def ring(reference, algorithm="gauss-seidel"):
    """Three in a ring, handing on arrays, whole numbers and truths; begins at 2 s."""
    system = System(start_time=2.0, stop_time=4.0, step=0.25, algorithm=algorithm)
    for k, name in enumerate("abc"):
        system.add(name, reference, flag=k != 1, size=k + 2, x=[1.0 * k, 2.0, 3.0])
    for source, target in (("a.x", "b.u"), ("b.y", "c.u"), ("c.x", "a.u"), ("a.more", "b.n"), ("b.more", "c.n")):
        system.connect(source, target)
    system.connect("a.odd", "b.b")
    system.connect("b.odd", "c.b")
    system.instances["a"].start["n"] = 4
    return system


def train(**start):
    """One train and one gust, connected."""
    system = System(stop_time=2.0, step=0.1)
    system.add("train", "PointMassTrain", force=1e5, **start)
    system.add("gust", "Gust", size=0.5, start_time=0.5, stop_time=1.0)
    system.connect("gust.acceleration", "train.disturbance")
    return system


def simulate(path, system, **more):
    step = more.pop("step", system.stepping.step)
    return fmpy.simulate_fmu(
        str(path),
        start_time=system.stepping.start_time,
        stop_time=system.stepping.stop_time,
        step_size=step,
        output_interval=step,
        **more,
    )


def names(result):
    return [name for name in result.dtype.names if name != "time"]


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_the_comfort_scenario_runs_in_fmpy_as_in_our_master(tmp_path, algorithm):
    system = load("comfort_cruise", algorithm=algorithm, stop_time=20.0)
    packed = pack(system, tmp_path / "platoon.fmu", expose=["train[:],cruise[:]"])
    result, ours = simulate(packed.path, system), run(system, kind="native")
    assert set(names(result)) == {shown.name for shown in packed.exposed}
    for name in names(result):
        np.testing.assert_allclose(result[name], ours[name], rtol=1e-9, atol=1e-9, err_msg=name)
    assert any("one step late" in note for note in packed.notes) == (algorithm == "jacobi")


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_arrays_integers_and_booleans_are_handed_on(tmp_path, components, algorithm):
    system = ring(components(KINDS)("Kinds"), algorithm)
    packed = pack(system, tmp_path / "ring.fmu")  # no train: everything is shown
    result, ours = simulate(packed.path, system), run(system, kind="native")
    assert sorted(names(result)) == sorted(ours.names())
    for name in names(result):
        np.testing.assert_allclose(result[name], ours[name], rtol=1e-9, err_msg=name)


def test_our_own_master_runs_it_as_any_fmu(tmp_path):
    path = pack(train(), tmp_path / "one.fmu").path
    outer = System(stop_time=2.0, step=0.1)
    outer.add("block", str(path))
    inner = run(train(), kind="native")
    np.testing.assert_array_equal(run(outer)["block.train.speed"], inner["train.speed"])


def test_the_archive_is_clean_and_equal_at_every_build(tmp_path):
    paths = [pack(train(), tmp_path / folder / "my-block.fmu").path for folder in ("a", "b")]
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert validate_fmu(str(paths[0])) == []
    description = fmpy.read_model_description(str(paths[0]))
    assert description.coSimulation.modelIdentifier == "my_block"
    speed = next(v for v in description.modelVariables if v.name == "train.speed")
    assert (speed.unit, speed.causality, speed.start) == ("m/s", "output", None)
    assert [v.name for v in description.modelVariables] == [
        f"train.{v}" for v in ("acceleration", "applied_force", "position", "speed")
    ]
    experiment = description.defaultExperiment
    assert (experiment.startTime, experiment.stopTime, experiment.stepSize) == ("0.0", "2.0", "0.1")
    with zipfile.ZipFile(paths[0]) as archive:
        assert b"Redistribution" in archive.read("documentation/licenses/fmu_manipulation_toolbox.txt")


def test_an_outer_step_of_several_inner_ones(tmp_path):
    system = train()
    path = pack(system, tmp_path / "one.fmu").path
    np.testing.assert_array_equal(
        simulate(path, system, step=0.5)["train.speed"], simulate(path, system)["train.speed"][::5]
    )


def test_parameters_and_free_inputs_can_be_set_from_outside(tmp_path):
    path = pack(train(), tmp_path / "one.fmu", expose=["train.speed", "gust.size", "train.line_resistance"]).path
    causality = {v.name: v.causality for v in fmpy.read_model_description(str(path)).modelVariables}
    assert causality == {"train.speed": "output", "gust.size": "parameter", "train.line_resistance": "input"}
    inside = train(line_resistance=0.02)
    inside.instances["gust"].start["size"] = 0.8
    given = {"gust.size": 0.8, "train.line_resistance": 0.02}
    found = simulate(path, inside, start_values=given, apply_default_start_values=True)
    np.testing.assert_array_equal(found["train.speed"], run(inside, kind="native")["train.speed"])


# -------------------------------------------------------------------- what is shown


@pytest.fixture(scope="module")
def checked():
    from railcosim.orchestrator.fmi.archive import Workspace
    from railcosim.orchestrator.run.checking import check

    system = load("comfort_cruise")
    with Workspace() as workspace:
        yield system, check(system, workspace, "plain")


@pytest.mark.parametrize(
    ("patterns", "expected"),
    [
        (["train[:].speed"], [f"train[{i}].speed" for i in range(1, 5)]),
        (["train[2].speed, gust.size"], ["train[2].speed", "gust.size"]),
        (["train[2].speed", "train[2].speed"], ["train[2].speed"]),
        (["gust"], ["gust.acceleration"]),
        (["target.*"], ["target.value"]),
        ([], [f"train[{i}].{v}" for i in range(1, 5) for v in ("acceleration", "applied_force", "position", "speed")]),
    ],
)
def test_what_is_exposed(checked, patterns, expected):
    shown, problems = select(patterns, *checked)
    assert [each.name for each in shown] == expected
    assert problems == []
    assert all(isinstance(each, Exposed) for each in shown)


@pytest.mark.parametrize(
    ("pattern", "part"),
    [
        ("trian[:].speed", "did you mean 'train'?"),
        ("train.speed", "for all of them write train[:]"),
        ("train[9].speed", "there is train[1], train[2]"),
        ("train[1].sped", "did you mean 'speed'?"),
        ("train[1].force", "is fed by cruise[1].force inside"),
        ("train[1]speed", "write instance.variable"),
    ],
)
def test_a_pattern_that_stands_for_nothing_says_why(checked, pattern, part):
    _, problems = select([pattern], *checked)
    assert part in str(problems[0])


# -------------------------------------------------------------------- what is refused


@pytest.mark.parametrize(
    ("options", "part"),
    [
        ({"delay": 1}, "delay = 1 cannot be packed"),
        ({"scale": 2.0}, "scale 2 and offset 0 cannot be packed"),
        ({"offset": 0.5}, "scale 1 and offset 0.5 cannot be packed"),
    ],
)
def test_what_a_container_cannot_do_is_refused_by_name(tmp_path, options, part):
    system = train()
    system.connections.clear()
    system.connect("gust.acceleration", "train.disturbance", **options)
    with pytest.raises(ScenarioError, match=part) as caught:
        pack(system, tmp_path / "one.fmu")
    assert "'train.disturbance' = 'gust.acceleration'" in str(caught.value)
    assert not (tmp_path / "one.fmu").exists()


@pytest.mark.parametrize(
    ("what", "change"),
    [
        ("[[events]]", lambda s: s.events.append(Event("gust.acceleration", "freeze", 0.5))),
        ("train: a step of its own", lambda s: setattr(s.instances["train"], "step", 0.2)),
        ("algorithm = iterative", lambda s: setattr(s.stepping, "algorithm", "iterative")),
        ("extrapolation = 1", lambda s: setattr(s.stepping, "extrapolation", 1)),
        ("refresh", lambda s: setattr(s.stepping, "refresh", True)),
        ("algebraic_loops = solve", lambda s: setattr(s.stepping, "algebraic_loops", "solve")),
    ],
)
def test_what_would_be_lost_in_a_container_is_refused(tmp_path, what, change):
    system = train()
    change(system)
    with pytest.raises(ScenarioError) as caught:
        pack(system, tmp_path / "one.fmu")
    assert str(caught.value).splitlines() == [f"{what} cannot be packed: a container has one step, and holds values"]


def test_a_conversion_of_units_is_refused(tmp_path, components):
    body = (
        "class Far(Component):\n    away = Output('km', description='far')\n\n"
        "    def outputs(self):\n        return {'away': 1.0}\n\n\n"
        "class Near(Component):\n    place = Input('m', description='near')\n"
        "    y = Output('m', description='same')\n\n"
        "    def outputs(self):\n        return {'y': self.place}\n"
    )
    mine = components(body)
    system = System(stop_time=1.0)
    system.add("far", mine("Far"))
    system.add("near", mine("Near"))
    system.connect("far.away", "near.place")
    with pytest.raises(ScenarioError, match=r"conversion of units \(times 1000, plus 0\) cannot be packed"):
        pack(system, tmp_path / "one.fmu")


def test_maps_are_refused(mine, tmp_path):
    system = System(stop_time=1.0)
    for name in ("a", "b"):
        system.add(name, mine("Whole"))
    system.connections.append(Connection("a.m", "b.n", map={"1": 2}))
    with pytest.raises(ScenarioError, match="a map cannot be packed"):
        pack(system, tmp_path / "one.fmu")


def test_python_fmus_are_refused(tmp_path):
    system = System(stop_time=1.0)
    system.add("train", str(build("PointMassTrain", kind="python")), force=0.0)
    with pytest.raises(ScenarioError, match="train: PointMassTrain is a Python FMU"):
        pack(system, tmp_path / "one.fmu")


def test_what_was_put_right_in_a_given_fmu_is_right_in_the_packed_one(tmp_path):
    """Paths with backslashes, and a helper that may be run, from a file that ends in capitals."""
    path = tmp_path / "Their Train.FMU"
    with zipfile.ZipFile(build("PointMassTrain", kind="native")) as ours, zipfile.ZipFile(path, "w") as theirs:
        for name in ours.namelist():
            theirs.writestr(name.replace("/", "\\"), ours.read(name))
        theirs.writestr("resources\\help.sh", "#!/bin/sh\n")
    system = System(stop_time=0.2, step=0.1)
    system.add("train", str(path), force=0.0)
    packed = pack(system, tmp_path / "one.FMU")
    assert packed.platforms == (fmpy.platform,)
    with zipfile.ZipFile(packed.path) as made:
        (helper,) = (entry for entry in made.infolist() if entry.filename.endswith("/help.sh"))
    assert helper.external_attr >> 16 == 0o755
    simulate(packed.path, system)


def test_a_platform_without_a_runtime_is_refused(tmp_path):
    with pytest.raises(ScenarioError, match="no container runtime for aarch64-linux"):
        pack(train(), tmp_path / "one.fmu", platforms=["aarch64-linux"])


def test_an_fmu_without_a_binary_for_a_platform_asked_for_is_refused(tmp_path):
    system = System(stop_time=1.0)
    system.add("train", str(build("PointMassTrain", kind="native")), force=0.0)
    other = "win64" if fmpy.platform != "win64" else "linux64"
    with pytest.raises(ScenarioError, match=f"train: .*PointMassTrain.fmu has no binary for {other}"):
        pack(system, tmp_path / "one.fmu", platforms=[other])


def test_without_the_toolbox_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "fmu_manipulation_toolbox.container", None)
    with pytest.raises(RailcosimError, match="pip install"):
        pack(train(), tmp_path / "one.fmu")


# -------------------------------------------------------------------- the command


def test_the_command(tmp_path, capsys):
    target = tmp_path / "platoon.fmu"
    assert (
        call(["pack", "comfort_cruise", "-o", str(target), "--expose", "train[:].speed", "--set", "gust.size=1"]) == 0
    )
    assert f"{target}: 10 FMUs as one, 4 variables, for {fmpy.platform}" in capsys.readouterr().out
    assert call(["pack", "comfort_cruise", "-o", str(target), "--expose", "trains"]) == 2
    assert "did you mean 'train'?" in capsys.readouterr().err
    assert call(["pack", "comfort_cruise", "-o", str(Path(tmp_path) / "platoon.zip")]) == 2
    assert "ends in .fmu" in capsys.readouterr().err
