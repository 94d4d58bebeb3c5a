"""Temporary folders whose owner is gone."""

from railcosim.orchestrator.leftovers import own, remove_where_abandoned


def test_a_folder_is_removed_where_its_owner_is_gone_and_no_other(tmp_path):
    for name, is_owned in (("abandoned", False), ("used", True), ("elsewhere", None)):
        inside = tmp_path / name / "fmus" / "host_1"
        inside.mkdir(parents=True)
        if is_owned is not None:
            lock = own(tmp_path / name)
            if not is_owned:
                lock.release()
                (tmp_path / name / ".in-use").touch()
        remove_where_abandoned(inside)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["elsewhere", "used"]
    lock.release()
