"""From instances to models: files read, components built, everything that is wrong said at once."""

from pathlib import Path

import pytest
from railcosim.fmus.build import build
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.fmi.binding.fmi2 import FmuSlave
from railcosim.orchestrator.fmi.models import load_fmu, load_models
from railcosim.orchestrator.fmi.plain import PlainSlave
from railcosim.orchestrator.scenario.loading import loads
from railcosim.orchestrator.system import System


def system(**models):
    it = System()
    for name, model in models.items():
        it.add(name, model)
    return it


def problems(it, workspace, kind="plain"):
    with pytest.raises(ScenarioError) as caught:
        load_models(it, workspace, kind)
    return [str(problem) for problem in caught.value.problems]


def test_instances_of_one_component_share_its_model(workspace):
    it = system(**{"train[1]": "PointMassTrain", "train[2]": "PointMassTrain", "gust": "Gust"})
    models = load_models(it, workspace, "python")
    assert models["train[1]"] is models["train[2]"]
    assert models["gust"].interface.model == "Gust"
    assert models["gust"].kind == "python"
    assert models["gust"].path == build("Gust", kind="python")


def test_other_build_arguments_are_another_model(workspace):
    it = System()
    it.add("a", "Schedule", {"points": 2})
    it.add("b", "Schedule", {"points": 3})
    models = load_models(it, workspace, "plain")
    assert [models[n].interface.arrays["values"][-1] for n in "ab"] == ["values[2]", "values[3]"]
    assert models["a"].digest != models["b"].digest


@pytest.mark.parametrize(("kind", "cls"), [("python", FmuSlave), ("plain", PlainSlave)])
def test_kinds(workspace, kind, cls):
    slave = load_models(system(gust="Gust"), workspace, kind)["gust"].instantiate("gust")
    assert type(slave) is cls
    assert slave.interface.model == "Gust"
    slave.free()


def test_a_file_stays_an_fmu_whatever_the_kind(workspace):
    path = build("Gust", kind="python")
    model = load_models(system(gust=str(path)), workspace, "plain")["gust"]
    assert (model.kind, model.path) == ("fmu", path)
    assert model.digest == load_fmu(path, workspace).digest


def test_a_file_takes_no_build_arguments(workspace, foreign, xml):
    path = foreign([xml["variable"]("y", "output")])
    it = System()
    it.add("gust", path, {"points": 3})
    assert problems(it, workspace) == [
        f"instance 'gust': {path} is built already; it takes no build arguments ['points']"
    ]


def test_all_that_is_missing_is_said_at_once_and_once(workspace, tmp_path):
    it = system(**{"train[1]": "PointMassTrian", "train[2]": "PointMassTrian", "ato": f"{tmp_path}/no.fmu"})
    it.add("mine", f"{tmp_path}/no.py:Mine").origin = "line.toml:7"
    it.add("fine", "Gust")
    it.add("schedule", "Schedule", {"pionts": 2})
    found = problems(it, workspace)
    assert found[0].startswith(
        "instance 'train': there is no component 'PointMassTrian'; did you mean 'PointMassTrain'?"
    )
    assert found[1] == f"instance 'ato': {tmp_path}/no.fmu cannot be read: No such file or directory"
    assert found[2] == f"line.toml:7: instance 'mine': there is no file {tmp_path}/no.py"
    assert found[3] == "instance 'schedule': Schedule has no 'pionts'; did you mean 'points'?"
    assert len(found) == 4


@pytest.mark.parametrize("kind", ["python", "plain"])
def test_a_component_that_cannot_become_an_fmu(workspace, components, kind):
    reference = components("class Odd(Base):\n    u = Input('furlong')\n")("Odd")
    (found,) = problems(system(odd=reference), workspace, kind)
    assert found.startswith("instance 'odd': ")
    assert "furlong" in found


@pytest.mark.parametrize("kind", ["python", "plain"])
def test_a_component_file_with_a_mistake_in_it(workspace, components, kind):
    reference = components("class Odd(Base):\n    u = Inptu('m')\n")("Odd")
    (found,) = problems(system(odd=reference), workspace, kind)
    path = Path(reference.rpartition(":")[0])
    line = path.read_text().splitlines().index("    u = Inptu('m')") + 1
    assert found == f"instance 'odd': {path}:{line}: NameError: name 'Inptu' is not defined"


@pytest.mark.parametrize("name", ["points", "pionts"])
def test_a_wrong_build_argument_is_told_where_it_was_given(workspace, name):
    text = "[simulation]\nstop_time = 1.0\n[instances.a]\n"
    text += 'component = "Schedule"\nbuild.points = 2\n[presets.p]\n"a.build.points" = 3\n'
    option = f"a.{name}=0"
    (told,) = problems(loads(text, "s.toml", builds=[option]), workspace)
    assert told.startswith(f"--with {option}: instance 'a': Schedule")
    (told,) = problems(loads(text.replace("= 3", "= 0"), "s.toml", preset="p"), workspace)
    assert told.startswith("s.toml:7: instance 'a': Schedule")
    (told,) = problems(loads(text.replace("= 2", "= 0"), "s.toml"), workspace)
    assert told.startswith("s.toml:3: instance 'a': Schedule")


def test_of_a_component_what_a_run_needs_is_unpacked_and_of_a_file_all(workspace):
    path = build("Gust", kind="python")
    models = load_models(system(component="Gust", file=str(path)), workspace, "python")
    assert not (models["component"].folder / "documentation").exists()
    assert (models["component"].folder / "resources").is_dir()
    assert (models["file"].folder / "documentation").is_dir()
