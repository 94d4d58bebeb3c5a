"""What is told of a run that goes on."""

from railcosim.orchestrator.cli.printing import show_progress


def test_progress_starts_at_the_start_time(capsys):
    with show_progress("late", False, start=100.0) as progress:
        lines = {}
        for time in (100.0, 104.0, 110.0):
            progress(time, 110.0)
            lines[time] = capsys.readouterr().err.splitlines()
    told = [f"late: {percent} % of 10 s" for percent in range(10, 101, 10)]
    assert lines == {100.0: [], 104.0: told[:4], 110.0: told[4:]}
    with show_progress("quiet", True) as progress:
        assert progress is None
