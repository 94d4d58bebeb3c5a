"""The record of a probe: what was found stays, whatever becomes of the process."""

from railcosim.orchestrator.validation.record import Record


def test_what_is_damaged_is_left_out_and_the_rest_is_kept(tmp_path):
    record = Record(tmp_path / "record")
    assert record.entries() == []
    record.trying("a call")
    record.add(died="SIGSEGV")
    record.trying("another")
    record.add(verdict="pass", detail="fine")
    with record.path.open("ab") as stream:
        stream.write(b'\xff\xfe\n3\n{"verdict": "fa')
    assert record.last("verdict") == "pass"
    assert record.last("trying") == "another"
    assert record.last("nothing") is None
    assert record.deaths() == {"a call": "SIGSEGV"}
