"""What a run has written down is read back within bounds."""

import pytest
from railcosim.orchestrator.errors import ScenarioError
from railcosim.orchestrator.run import Results, record
from railcosim.orchestrator.run.recording import check_size, read_json
from railcosim.orchestrator.run.recording.told import MOST


def test_what_was_written_is_read(tmp_path):
    (tmp_path / "run.json").write_text('{"a": [1, 2.5, null]}')
    assert read_json(tmp_path / "run.json") == {"a": [1, 2.5, None]}
    check_size("run.json", MOST)


@pytest.mark.parametrize("read", [Results.load, record.read])
def test_a_strange_directory_is_refused_in_one_sentence(tmp_path, read):
    path = tmp_path / "run.json"
    path.write_text(100_000 * '{"a":')
    with pytest.raises(ScenarioError, match=r"holds no run that can be read: run\.json is nested too deep$"):
        read(tmp_path)
    with path.open("wb") as stream:
        stream.truncate(12 << 30)
    with pytest.raises(ScenarioError, match=r": run\.json has 12288 MiB, and no run writes more than 256$"):
        read(tmp_path)
