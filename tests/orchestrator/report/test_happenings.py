"""Bands and gradients: what happened to a run, and what its models were built with."""

from railcosim.orchestrator import run
from railcosim.orchestrator.report.happenings import bands_of
from railcosim.orchestrator.report.trains import gradients_of
from railcosim.orchestrator.system import Event


def test_events_are_bands(wavy, tmp_path, told):
    system = wavy()
    system.events += [
        Event("wave.y", "bias", 2.0, value=0.1, duration=3.0),
        Event("wave.y", "override", 18.0, value=0.0),
        Event("lag[1].u", "freeze", 1.0, duration=0.5, every=6.0),
    ]
    run(system, kind="native", output=tmp_path / "run", figures=False)
    data, _ = told(tmp_path / "run")
    bands = [(band["from"], band["until"], band["label"]) for band in data["runs"][0]["bands"]]
    assert bands[:2] == [(2.0, 5.0, "bias wave.y"), (18.0, 20.0, "override wave.y")]
    assert [begin for begin, *_ in bands[2:]] == [1.0, 7.0, 13.0, 19.0]


def test_what_models_were_built_with_is_shown():
    """Faults and outages as bands, gradients under the trains."""
    record = {
        "stop_time": 100.0,
        "instances": {
            "faults": {
                "build": {"schedule": [{"carriage": 1, "from": 10.0, "until": 20.0}, {"from": 200.0, "until": 300}]}
            },
            "radio": {"build": {"outages": [[60.0, 72.0]], "messages": 16}},
            "line": {"build": {"line": [{"position": 0.0}, {"position": 500.0, "gradient": 0.01}]}},
        },
    }
    bands = [(band["from"], band["until"], band["label"]) for band in bands_of(record)]
    assert bands == [(10.0, 20.0, "faults: schedule"), (60.0, 72.0, "radio: outages")]
    assert gradients_of({}) == []
    steps = [{"from": 0.0, "gradient": 0.0}, {"from": 500.0, "gradient": 0.01}]
    assert gradients_of(record) == steps
    line = record["instances"]["line"]["build"]
    line["line"] = {"name": "a line with more than sections", "sections": line["line"]}
    assert gradients_of(record) == steps
