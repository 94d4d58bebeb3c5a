"""Building: arguments, identity, the cache, reproducibility, and where the result runs."""

import json
import os
import re
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from railcosim.components import ComponentError, simulate
from railcosim.fmus import build as build_module
from railcosim.fmus.build import build, build_component, cache_folder, plain, write_archive, write_whole
from railcosim.fmus.references import resolve
from railcosim.orchestrator import world
from railcosim.orchestrator.errors import FmuFileError
from railcosim.orchestrator.fmi.archive import Workspace
from railcosim.orchestrator.fmi.models import load_fmu

USER = (
    "from railcosim.components import Component, Output\n\n\nclass C(Component):\n    y = Output('1')\n\n"
    "    def outputs(self):\n        return {'y': 1.0}\n"
)


@pytest.fixture
def fresh_cache(tmp_path, monkeypatch):
    """Take a new, empty cache; call again for another one."""
    taken = []

    def take():
        taken.append(tmp_path / f"cache{len(taken)}")
        monkeypatch.setenv("RAILCOSIM_CACHE", str(taken[-1]))
        return taken[-1]

    take()
    return take


def run_python(*arguments, **environment):
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


# ---------------------------------------------------------------- build arguments


def annotation(path):
    description = zipfile.ZipFile(path).read("modelDescription.xml").decode()
    return fmpy.read_model_description(str(path)), description


def test_build_arguments_reach_the_fmu(instantiate, sample):
    chain = instantiate(sample("Chain"), {"masses": 4}).initialize(**{"position[3]": 1.0})
    assert [chain.get(f"tension[{k}]") for k in (1, 2, 3)] == [0.0, -1.0, 1.0]
    assert "position[5]" not in chain.variables
    slope = instantiate(sample("Slope"), {"profile": [[0.0, 0.0], [10.0, 30.0]], "height_unit": "mm"})
    slope.initialize(position=5.0)
    assert slope.get("height") == 15.0
    assert slope.variables["height"].unit == "mm"


def test_build_arguments_are_part_of_the_identity(sample, model):
    paths, guids, shown = [], [], []
    for masses in (3, 4, 5):
        paths.append(build(sample("Chain"), {"masses": masses}))
        root = model(sample("Chain"), {"masses": masses})
        guids.append(root.get("guid"))
        shown.append(json.loads(root.find("VendorAnnotations/Tool/component").get("arguments")))
    assert len(set(paths)) == len(set(guids)) == len({p.parent.name for p in paths}) == 3
    assert shown == [{"masses": 3}, {"masses": 4}, {"masses": 5}]
    assert build(sample("Chain")) == build(sample("Chain"), {"masses": 3}) == paths[0]


def test_arguments_that_change_no_interface_still_tell_fmus_apart(instantiate, sample):
    profiles = [[[0.0, 0.0], [10.0, 10.0]], [[0.0, 0.0], [10.0, 20.0]]]
    both = [instantiate(sample("Slope"), {"profile": p}).initialize(position=5.0) for p in profiles]
    assert [one.get("height") for one in both] == [5.0, 10.0]
    assert both[0].description.guid != both[1].description.guid


@pytest.mark.parametrize(
    ("name", "arguments", "complaint"),
    [
        ("Chain", {"mases": 4}, "Chain has no 'mases'; did you mean 'masses'?"),
        ("Chain", {"masses": 1}, "Chain: build argument 'masses' takes a whole number of at least 2, not 1"),
        ("Chain", {"masses": 2.5}, "takes a whole number of at least 2, not 2.5"),
        ("Chain", {"masses": True}, "takes a whole number of at least 2, not True"),
        (
            "Slope",
            {"profile": [[1.0, 0.0], [0.0, 0.0]]},
            "build argument 'profile' is unusable: positions must",
        ),
        ("Slope", {"profile": "line"}, "build argument 'profile' is unusable"),
        ("Slope", {"profile": np.eye(2)[::-1]}, "Slope: build arguments are JSON data"),
        ("Slope", {"height_unit": "furlong"}, "'furlong' is not a unit known here"),
    ],
)
def test_unusable_arguments(sample, name, arguments, complaint):
    with pytest.raises(ValueError, match=re.escape(complaint)):
        build(sample(name), arguments)


@pytest.mark.parametrize("profile", ["model-exchange", "real-time"])
def test_python_fmus_have_no_profiles(component_class, profile):
    with pytest.raises(ComponentError, match=f"^the profile {profile} is for native FMUs; Python FMUs have none"):
        build_component(component_class("ComfortCruise")(), "python", profile=profile)


@pytest.mark.parametrize(
    ("equation", "said"),
    [
        ("{}", "Mine.outputs returns no value of ['y'] (mine.py:8)"),
        ('{"y": self.spead}', "Mine.outputs: Mine has no 'spead'; did you mean 'speed'? (at mine.py:9, "),
    ],
)
def test_a_mistake_in_the_equations_is_no_reason_for_another_kind(tmp_path, equation, said):
    """A forgotten output and a misspelt name are told with the line in their author's file."""
    path = tmp_path / "mine.py"
    path.write_text(
        "from railcosim.components import Component, Input, Output\n\n\nclass Mine(Component):\n"
        f'    speed = Input("m/s")\n    y = Output("m/s")\n\n    def outputs(self):\n        return {equation}\n'
    )
    for kind in ("auto", "python"):
        with pytest.raises(ComponentError) as told:
            build_module.package(f"{path}:Mine", {}, kind)
        assert said in str(told.value)


def test_start_values_given_to_the_component_are_part_of_the_identity(component_class):
    gust = component_class("Gust")
    assert build_component(gust()) == build("Gust")
    assert build_component(gust(size=0.5)) == build("Gust")  # the default, said once more
    assert build_component(gust(size=0.75)) != build("Gust")
    assert annotation(build_component(gust(size=0.75)))[0].modelVariables[0].start == "0.75"


# ---------------------------------------------------------------- the cache


@pytest.mark.few
def test_two_builds_are_the_same_bytes(reference, fresh_cache):
    first = build(reference)
    second_cache = fresh_cache()
    second = build(reference)
    assert first != second
    assert second.is_relative_to(second_cache)
    assert first.relative_to(first.parents[2]) == second.relative_to(second.parents[2])
    assert first.read_bytes() == second.read_bytes()


def test_another_process_with_another_hash_seed_and_clock_builds_the_same_bytes(fresh_cache, tmp_path, sample):
    code = "import sys; from railcosim.fmus.build import build; print(build(sys.argv[1]))"
    own = build(sample("Everything"))
    done = run_python(
        "-c",
        code,
        sample("Everything"),
        PYTHONHASHSEED="4711",
        TZ="Asia/Tokyo",
        RAILCOSIM_CACHE=str(tmp_path / "other"),
    )
    other = Path(done.stdout.strip())
    assert other.is_relative_to(tmp_path / "other"), done.stderr
    assert other.read_bytes() == own.read_bytes()


@pytest.mark.few
def test_the_archive_tells_neither_time_nor_machine(reference):
    with zipfile.ZipFile(build(reference)) as archive:
        entries = archive.infolist()
        assert [e.filename for e in entries] == sorted(e.filename for e in entries)
        assert {e.date_time for e in entries} == {(1980, 1, 1, 0, 0, 0)}
        assert {(e.create_system, e.external_attr >> 16, e.compress_type) for e in entries} == {(3, 0o644, 8)}
        for entry in entries:
            if not entry.filename.startswith("binaries/"):
                assert str(Path.home()).encode() not in archive.read(entry)
                assert str(Path(__file__).parents[2]).encode() not in archive.read(entry)
        platforms = {n.split("/")[1] for n in archive.namelist() if n.startswith("binaries/")}
    assert platforms == {"linux64", "win64"}


def test_a_cache_hit_does_not_write(fresh_cache):
    path = build("Gust")
    os.utime(path, (1e9, 1e9))
    inode = path.stat().st_ino
    assert build("Gust") == path
    assert (path.stat().st_mtime, path.stat().st_ino) == (1e9, inode)
    assert sorted(p.name for p in path.parent.iterdir()) == ["Gust.fmu", "Gust.fmu.sha256"]


@pytest.mark.parametrize("damage", [b"", b"half", None])
def test_a_damaged_entry_is_made_anew(fresh_cache, damage):
    path = build("Gust")
    sound = path.read_bytes()
    path.write_bytes(sound[:-1] + bytes([sound[-1] ^ 1]) if damage is None else damage)
    assert build("Gust").read_bytes() == sound
    path.with_name("Gust.fmu.sha256").unlink()
    path.write_bytes(b"of before there were digests")
    assert build("Gust").read_bytes() == sound


def test_a_cache_that_cannot_be_written_costs_speed_only(monkeypatch, tmp_path, caplog):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("RAILCOSIM_CACHE", str(tmp_path / "file"))
    path = build("Gust")
    assert zipfile.ZipFile(path).testzip() is None
    assert build("Gust") == path
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("file", "in the way")]
    (told,) = caplog.messages
    assert told.startswith(f"{tmp_path / 'file' / 'fmus'} cannot be written (Not a directory)")
    assert told.endswith("name another folder in RAILCOSIM_CACHE")


def test_changed_equations_take_another_place(write_component, fresh_cache):
    first = build(write_component(USER))
    second = build(write_component(USER.replace("1.0", "2.0")))
    third = build(write_component(USER))
    assert first == third != second


def test_the_users_cache_is_the_default(monkeypatch, tmp_path):
    monkeypatch.delenv("RAILCOSIM_CACHE")
    monkeypatch.setattr(build_module.platformdirs, "user_cache_dir", lambda name, **_: str(tmp_path / name))
    assert cache_folder() == tmp_path / "railcosim" / "fmus"


@pytest.mark.parametrize("failure", [OSError("disk full"), KeyboardInterrupt()])
def test_an_interrupted_build_leaves_nothing(fresh_cache, monkeypatch, failure):
    cache = Path(os.environ["RAILCOSIM_CACHE"])
    written = []
    whole = zipfile.ZipFile.writestr

    def writestr(self, entry, data):
        written.append(entry)
        if len(written) == 5:
            raise failure
        whole(self, entry, data)

    monkeypatch.setattr(zipfile.ZipFile, "writestr", writestr)
    with pytest.raises(type(failure)):
        build("Gust")
    assert len(written) == 5
    assert [p for p in cache.rglob("*") if p.is_file()] == []
    monkeypatch.undo()
    monkeypatch.setenv("RAILCOSIM_CACHE", str(cache))
    assert zipfile.ZipFile(build("Gust")).testzip() is None


def test_an_existing_file_survives_an_interrupted_write(tmp_path):
    target = tmp_path / "it.fmu"
    target.write_bytes(b"old")
    with pytest.raises(TypeError):
        write_archive({"a": b"fine", "b": None}, target)
    with pytest.raises(TypeError):
        write_whole("text", target)
    assert [(p.name, p.read_bytes()) for p in tmp_path.iterdir()] == [("it.fmu", b"old")]


def test_a_file_that_another_process_has_just_written_and_holds_is_taken(fresh_cache, monkeypatch):
    """As on Windows, where an open file cannot be replaced."""

    def replace(source, target):
        Path(target).write_bytes(Path(source).read_bytes())
        raise PermissionError(target)

    monkeypatch.setattr(build_module.os, "replace", replace)
    path = build("Gust")
    assert [p.name for p in path.parent.iterdir()] == ["Gust.fmu"]


@pytest.mark.long
def test_processes_building_at_once_do_not_break_each_other(fresh_cache, sample):
    code = (
        "import sys, time, zipfile\nfrom railcosim.fmus.build import build\n"
        "whole = zipfile.ZipFile.writestr\n"
        "zipfile.ZipFile.writestr = lambda *a: (time.sleep(0.01), whole(*a))\n"  # so that they surely overlap
        "time.sleep(max(0, float(sys.argv[1]) - time.time()))\n"
        "for name in sys.argv[2:]:\n    path = build(name); assert zipfile.ZipFile(path).testzip() is None; print(path)"
    )
    start = run_python("-c", "import time; print(time.time() + 1.5)").stdout.strip()
    names = ["Gust", "PointMassTrain", "ComfortCruise", sample("Everything")]
    running = [
        subprocess.Popen([sys.executable, "-c", code, start, *names], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        for _ in range(3)
    ]
    told = [process.communicate(timeout=60) for process in running]
    assert [process.returncode for process in running] == [0, 0, 0], told
    assert told[0][0] == told[1][0] == told[2][0]
    cache = Path(os.environ["RAILCOSIM_CACHE"])
    models = ("ComfortCruise", "Everything", "Gust", "PointMassTrain")
    files = [f"{model}.fmu{ending}" for model in models for ending in ("", ".sha256")]
    assert sorted(p.name for p in cache.rglob("*") if p.is_file()) == files


def test_a_plain_component_shows_the_same_description(sample):
    described = zipfile.ZipFile(build(sample("Chain"), {"masses": 4})).read("modelDescription.xml")
    found = plain(sample("Chain"), {"masses": 4})
    assert found.description == described
    one, other = found.instantiate(), found.instantiate()
    one.set("mass", 3.0)
    assert (one.get("mass"), other.get("mass")) == (3.0, 1.0)


# ---------------------------------------------------------------- where it runs


def test_an_fmu_in_a_folder_with_spaces_and_letters_of_any_alphabet(tmp_path):
    folder = tmp_path / "Zug über Größe (100 %) +#é 列車"
    folder.mkdir()
    path = folder / "Wind böe.fmu"
    path.write_bytes(build("Gust").read_bytes())
    with Workspace() as workspace:
        slave = load_fmu(path, workspace).instantiate("böe[1]")
        slave.setup(205.0, 300.0)
        slave.enter_initialization()
        slave.exit_initialization()
        channel = slave.channel("Real", ["acceleration"])
        slave.step(205.0, 10.0)
        assert channel.get() == [-0.5]
        slave.terminate()
        slave.free()


def test_without_a_plain_folder_it_is_refused_before_anything_is_loaded(tmp_path, monkeypatch):
    odd = tmp_path / "größe"
    odd.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(odd))
    whole = world.mkdtemp

    def mkdtemp(suffix=None, prefix=None, dir=None):
        if dir is not None:
            raise PermissionError(dir)
        return whole(suffix, prefix, dir)

    monkeypatch.setattr(world, "mkdtemp", mkdtemp)
    with pytest.raises(FmuFileError) as caught:
        Workspace()
    message = str(caught.value)
    assert f"FMUs cannot be unpacked below {str(odd)!r}" in message
    assert "set TMPDIR" in message
    assert len(message.splitlines()) == 1
    assert list(odd.iterdir()) == []


BARE = """
import sys
sys.path[:0] = sys.argv[1:2]


class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ("railcosim", "pythonfmu", "platformdirs", "scipy", "networkx"):
            raise ImportError("not on this machine: " + name)


sys.meta_path.insert(0, Refuse())
for name in ("railcosim", "pythonfmu"):
    try:
        __import__(name)
    except ImportError:
        pass
    else:
        raise SystemExit(name + " can be imported")
import fmpy
for path in sys.argv[2:]:
    result = fmpy.simulate_fmu(path, stop_time=1.0, output_interval=0.125)
    print(" ".join(float(x).hex() for x in result[result.dtype.names[-1]]))
"""


def test_it_runs_where_the_project_is_not_installed(sample):
    """A bare Python (-I) that has NumPy and FMPy and refuses to import this project."""
    references = [sample("Chain"), "PointMassTrain", sample("Dice"), sample("Estimator")]
    done = run_python("-I", "-c", BARE, Path(fmpy.__file__).parents[1], *(build(r) for r in references))
    assert done.returncode == 0, done.stderr
    for reference, line in zip(references, done.stdout.splitlines(), strict=True):
        component = resolve(reference)()
        last = fmpy.read_model_description(str(build(reference))).outputs[-1].variable.name
        slot = component.slots[last.partition("[")[0]]
        own = simulate(component, 1.0, 0.125)[slot.name].reshape(9, -1)[:, slot.scalars.index(last)]
        assert [float.fromhex(x) for x in line.split()] == own.tolist()
