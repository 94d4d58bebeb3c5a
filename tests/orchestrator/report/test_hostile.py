"""Texts that want to run: from scenarios, FMUs, records and tables. A page shows them and does nothing."""

import json

import pytest
from railcosim.orchestrator.report import write_report

pytestmark = pytest.mark.long


def told(record, text):
    """What a run says of itself, with a text wherever one may come from outside."""
    figure = {"title": text, "remark": text, "y": ["lag[1].x", "2 * wave.y"], "label": [text, text], "y_label": text}
    over = {"title": text, "x": "lag[1].x", "y": ["lag[2].x"], "x_label": text, "marks": [{"x": 0.1, "label": text}]}
    event = {"signal": text, "action": text, "at": 3.0, "duration": 2.0, "every": None}
    changed = dict.fromkeys(
        ("title", "scenario", "preset", "error", "python", "platform", "algorithm", "command"), text
    )
    instances = {
        name: {**one, "model": text, "digest": text, "kind": text} for name, one in record["instances"].items()
    }
    wires = [{"source": f"{text}.y", "target": "lag[1].u", "delay": 0}, *record["connections"]]
    return (
        record
        | changed
        | {"status": "failed", "notes": [text], "findings": [{"message": text}], "events": [event], "late": [text]}
        | {"instances": {**instances, text: {**instances["wave"], "build": {text: [[1.0, 2.0]]}}}, "connections": wires}
        | {"units": dict.fromkeys(record["units"], text), "versions": {text: text}, "figures_wanted": [figure, over]}
        | {"parameters": {**record["parameters"], text: text}, "order": [text, *record["order"]]}
    )


def test_a_run(opened, directory, hostile_text, is_inert):
    text = hostile_text
    path = directory / "run.json"
    path.write_text(json.dumps(told(json.loads(path.read_text()), text)))
    path = directory / "metrics.json"
    found = json.loads(path.read_text())
    for one in found["requirements"]:
        one |= {"name": text, "text": text, "reason": text}
    metric = {"values": {text: 1.0}, "unit": text, "expression": text, "problem": text}
    value = dict.fromkeys(("verdict", "metric", "unit", "origin", "claim", "where", "reason", "departs"), text)
    found |= {"metrics": {text: metric}, "published": [value | dict.fromkeys(("value", "measured", "tolerance"), 1.0)]}
    path.write_text(json.dumps(found))
    page = opened(write_report([directory], names=[text]))
    assert page.title().startswith(text[:16])
    page.locator("[data-requirement]").first.click()
    page.get_by_text("Choose signals").click()
    page.evaluate("() => document.querySelectorAll('details').forEach((one) => (one.open = true))")
    page.wait_for_timeout(300)
    is_inert(page)
    assert text[:16] in page.locator("h1").text_content()
