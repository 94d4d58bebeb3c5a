"""A worker has all it needs from what it is sent, in whatever folder or machine it is."""

import hashlib
import os
import shutil
import zipfile
from dataclasses import replace

import pytest
from railcosim.orchestrator import System, world
from railcosim.orchestrator.errors import RailcosimError
from railcosim.orchestrator.fmi import models
from railcosim.orchestrator.packing import export
from railcosim.orchestrator.study import Runner
from railcosim.orchestrator.study.campaign import worker
from railcosim.orchestrator.study.campaign.parcel import MODELS, packed, this_version

OWN = """
from gains import GAIN
from railcosim.components import Component, Data, Input, State


class Mine(Component):
    slope = Data("a slope")
    x = State("1", 1.0, output=True)

    def derivatives(self):
        return {"x": GAIN * self.slope["slope"]}
"""
SCENARIO = """
[simulation]
stop_time = 1.0
step = 0.1
[instances.mine]
component = "parts/mine.py:Mine"
build = { slope = "slope.json" }
[instances.far]
component = "FAR/mine.py:Mine"
build = { slope = "FAR/slope.json" }
[metrics]
end = "final(mine.x) + 10 * final(far.x)"
"""


def unpack_all(parcel):
    return [content for _, content in parcel.contents()]


@pytest.fixture
def study(tmp_path, monkeypatch):
    """A scenario with files beside it and elsewhere, its parcel as it is sent, its contents, and how it ran here."""
    monkeypatch.setattr(models, "_PROVIDED", {})

    def make(kind="plain", **how):
        for place, gain in ((tmp_path / "home/parts", 2.0), (tmp_path / "far", 3.0)):
            place.mkdir(parents=True, exist_ok=True)
            (place / "mine.py").write_text(OWN)
            (place / "gains.py").write_text(f"GAIN = {gain}")
        (tmp_path / "home/slope.json").write_text('{"slope": 0.5}')
        (tmp_path / "far/slope.json").write_text('{"slope": 0.25}')
        scenario = tmp_path / "home/study.toml"
        scenario.write_text(SCENARIO.replace("FAR", str(tmp_path / "far")))
        how = {"scenario": str(scenario), "kind": kind, **how}
        with Runner(**how) as runner:
            parcel = packed(how, [runner.load({})], kind)
            return parcel, unpack_all(parcel), runner.run()

    yield make
    for digest in list(worker._OPEN):
        worker.forget(digest)


@pytest.mark.parametrize("kind", ["plain", "native"])
def test_it_runs_where_none_of_the_files_are(study, tmp_path, kind, monkeypatch):
    parcel, contents, here = study(kind)
    shutil.rmtree(tmp_path / "home")
    shutil.rmtree(tmp_path / "far")
    if kind == "native":  # nor a compiler
        monkeypatch.setattr(models, "package", None)
    assert {path.rpartition("/")[2] for path in parcel.files} == {"study.toml", "mine.py", "gains.py", "slope.json"}
    assert worker.work(parcel.sent(), [{}], None) is None
    worker.work(parcel.sent(), [], contents)
    rows, seconds = worker.work(parcel.sent(), [{}, {"mine.x": 3.0}], None)
    assert rows[0].error == ""
    assert rows[0].metrics == here.metrics
    assert rows[1].metrics["end"] == pytest.approx(here.metrics["end"] + 2.0)
    assert seconds > 0.0


def test_files_that_options_and_changes_name_are_found(study, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    study()
    options = {"swaps": ["mine=far/mine.py:Mine"], "settings": ['far.build.slope="home/slope.json"', "far.x=2"]}
    parcel, contents, here = study(**options)
    changes = {"mine.build.slope": "far/slope.json"}
    with Runner(**parcel.how) as runner:
        changed = runner.run(changes)
    parcel = packed(parcel.how, [Runner(**parcel.how).load(given) for given in ({}, changes)], "plain")
    contents = unpack_all(parcel)
    shutil.rmtree(tmp_path / "home")
    shutil.rmtree(tmp_path / "far")
    rows, _ = worker.work(parcel, [{}, changes], contents)
    assert [row.metrics for row in rows] == [here.metrics, changed.metrics]
    assert here.metrics != changed.metrics


def test_what_went_wrong_is_said_of_the_senders_files(study, tmp_path):
    parcel, contents, _ = study()
    rows, _ = worker.work(parcel, [{"mine.y": 1.0}, {"far.build.slope": "none.json"}], contents)
    assert [row.status for row in rows] == ["refused", "refused"]
    with Runner(**parcel.how) as runner:
        assert rows[0].error == runner.run({"mine.y": 1.0}).error


def test_a_shipped_scenario_does_not_travel(monkeypatch):
    how = {"scenario": "comfort_cruise", "kind": "plain", "stop_time": 2.0}
    with Runner(**how) as runner:
        parcel = packed(how, [runner.load({})], "plain")
    assert list(parcel.files) == [os.path.join(MODELS, "comfort_cruise.toml")]
    assert not unpack_all(parcel)
    assert worker.work(parcel, [{}], [])[0][0].status == "completed"
    worker.forget(parcel.digest)
    elsewhere = replace(parcel, models="/opt/models", files={"/opt/models/comfort_cruise.toml": "0" * 64})
    with pytest.raises(RailcosimError, match=r"a worker has another comfort_cruise\.toml than the study"):
        worker.work(elsewhere, [{}], [])


def test_an_archive_travels_with_its_variants(tmp_path, monkeypatch):
    """By a path from a folder, too; the variant is named behind the file, wherever that is."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "home").mkdir()
    system = System(stop_time=2.0, step=0.5)
    system.add("target", "Schedule", values=1.0)
    export(system, tmp_path / "home/a.ssp")
    with zipfile.ZipFile(tmp_path / "home/a.ssp", "a") as archive:
        text = archive.read("SystemStructure.ssd")
        assert b'stopTime="2.0"' in text
        archive.writestr("Short.ssd", text.replace(b'stopTime="2.0"', b'stopTime="1.0"').replace(b"= 2.0", b"= 1.0"))
    for name, end in (("home/a.ssp", 2.0), ("home/a.ssp#Short", 1.0)):
        how = {"scenario": name, "record": ["target.value"]}
        with Runner(**how) as runner:
            parcel = packed(how, [runner.load({})], "auto")
        contents = unpack_all(parcel)
        with monkeypatch.context() as patch:
            patch.chdir("/")
            (row,), _ = worker.work(parcel, [{}], contents)
        worker.forget(parcel.digest)
        assert row.status == "completed", row.error
        assert row.series["time"][-1] == end


def test_another_version_is_refused(study):
    parcel, contents, _ = study()
    other = replace(parcel, version="0.0.1")
    with pytest.raises(RailcosimError, match=rf"a worker has railcosim {this_version()}, and the study 0\.0\.1"):
        worker.work(other, [{}], contents)


def test_another_machine_builds_for_itself(study):
    parcel, contents, here = study("native")
    rows, _ = worker.work(replace(parcel, machine="Plan 9"), [{}], contents)
    assert rows[0].metrics == here.metrics
    assert not models._PROVIDED


def test_no_room_is_told(study, monkeypatch):
    parcel, contents, _ = study()

    def full(path, *_):
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(world, "write_bytes", full)
    with pytest.raises(RailcosimError, match=r"a worker cannot unpack .*: No space left on device"):
        worker.work(parcel, [{}], contents)


def test_a_file_that_changes_meanwhile_is_not_sent(study, tmp_path):
    parcel, *_ = study()
    (tmp_path / "home/slope.json").write_text("{}")
    with pytest.raises(RailcosimError, match=r"slope\.json has changed while the study was about to begin"):
        unpack_all(parcel)


def test_nothing_is_left_of_a_study_that_is_forgotten(study):
    parcel, contents, _ = study()
    worker.work(parcel, [{}], contents)
    place = worker._OPEN[parcel.digest]._place
    assert place.is_dir()
    worker.forget(parcel.digest)
    worker.forget(parcel.digest)
    assert not place.exists()


def test_files_travel_by_what_they_hold(study):
    parcel, contents, _ = study()
    digests = [digest for digest, _ in parcel.contents()]
    assert digests == [hashlib.sha256(content).hexdigest() for content in contents]
    assert len(set(digests)) == len(digests) == len(set(parcel.files.values()))
