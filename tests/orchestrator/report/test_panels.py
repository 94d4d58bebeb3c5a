"""The panels of a page: those over time, those over something else, and what is marked in them."""

import json

from railcosim.orchestrator import System, run
from railcosim.orchestrator.figures import curves, outline


def test_panels_over_time_show_signals_by_their_own_columns(directory, told):
    data, (content,) = told(directory)
    both, scaled, another = data["panels"]
    assert both["title"] == "Both </script>"
    names = ["lag[1].x", "lag[2].x", "wave.y"]
    assert [line["column"] for line in both["lines"][:3]] == [content.places[name] for name in names]
    assert both["lines"][3]["column"] not in content.places.values()
    assert scaled["title"].startswith("twice, up to 0.")
    assert scaled["label"] == "2 x"
    assert scaled["lines"][0]["column"] not in content.places.values()
    assert (another["over"], another["x_label"]) == ("another", "x")
    (line,) = another["lines"]
    assert line["column"] == content.places["lag[2].x"]
    assert line["x"] == content.places["lag[1].x"]
    assert "over" not in both
    assert "x" not in both["lines"][0]


def test_figures_of_signals_that_are_not_there(directory, told):
    """A run that was swapped or cut short may lack them; a page shows the rest."""
    path = directory / "run.json"
    record = json.loads(path.read_text())
    first, second, _ = record["figures_wanted"]
    first["y"] = ["missing.x"]
    second["panels"][0]["title"] = "up to {missing.x}"
    path.write_text(json.dumps(record))
    data, _ = told(directory)
    assert [panel["title"] for panel in data["panels"]] == ["up to {missing.x}", "Over another"]


def test_what_a_panel_asks_for(wavy, tmp_path, told):
    """Ranges, logarithmic axes, levels and marks; a level of what is not there is left out."""
    system = wavy()
    asked = {
        "x_range": [0.1, 5.0],
        "y_range": [0.1, 2.0],
        "y_log": True,
        "x_log": True,
        "scale": 2.0,
        "x_label": "way",
        "y_label": "x",
    }
    levels = [0.25, ["lag[1].x_start", 0.5]]
    marks = [{"x": 3.0, "y": 0.25, "label": "stated"}, {"x": 4.0}]
    system.judged.figures = [
        {"title": "Asked", "x": "lag[1].x", "y": ["lag[2].x"], "bands": levels, "marks": marks, **asked},
        {"title": "A function", "x": {"name": "d", "from": 1, "to": 3, "points": 5}, "y": ["d**2"]},
    ]
    run(system, kind="native", output=tmp_path, figures=False)
    record = json.loads((tmp_path / "run.json").read_text())
    record["figures_wanted"][0]["bands"].append("missing.x")
    record["figures_wanted"][0]["marks"].append({"y": "missing.x"})
    (tmp_path / "run.json").write_text(json.dumps(record))
    data, _ = told(tmp_path)
    panel, function = data["panels"]
    assert {key: panel[key] for key in ("x_range", "y_range", "y_log", "x_log", "x_label")} == {
        key: asked[key] for key in ("x_range", "y_range", "y_log", "x_log", "x_label")
    }
    assert panel["levels"] == [[0.5], [0.6, 1.0]]
    assert panel["marks"][0] == {"x": 3.0, "y": 0.5, "label": "stated"}
    assert [(mark["x"], mark["y"]) for mark in panel["marks"][1:]] == [(4.0, None), (None, None)]
    assert data["columns"][function["lines"][0]["x"]]["points"] == 5
    assert function["x_label"] == "d"


def test_the_instant_that_decided_is_marked_where_its_signals_are_drawn(directory, told):
    data, _ = told(directory)
    both = data["panels"][0]
    marked = {line["label"]: [told["name"] for told in line.get("decided", ())] for line in both["lines"]}
    assert marked == {"lag 1": [], "lag 2": ["low", "lower"], "wave y": [], "lag[1].x - wave.y": []}
    decided = both["lines"][1]["decided"][1]
    assert (decided["verdict"], decided["time"]) == ("fail", 0.0)
    assert decided["margin"] < 0.0


def test_curves_of_what_holds_between_points_are_steps(mine, tmp_path, told):
    system = System(stop_time=1.0, step=0.1)
    system.add("word", mine("Word"))
    system.add("wave", mine("Wave"))
    system.judged.figures = [
        {"title": "Steps", "y": ["word.n", "2 * word.n", "word.n + wave.y", "1.5"]},
        {"title": "Over it", "x": "word.n", "y": ["word.n"]},
    ]
    run(system, kind="plain", output=tmp_path, figures=False)
    data, _ = told(tmp_path)
    assert [[line.get("steps", False) for line in panel["lines"]] for panel in data["panels"]] == [
        [True, True, False, False],
        [False],
    ]


def test_a_plain_signal_is_whole_however_many_points_it_has(wavy, tmp_path, told, monkeypatch):
    """What is computed of more points than a figure can show is the outline of it."""
    run(wavy(), kind="native", output=tmp_path, figures=False)
    monkeypatch.setattr(curves, "MOST_POINTS", 100)
    monkeypatch.setattr(outline, "_PIECES", 20)
    data, (content,) = told(tmp_path)
    plain, computed = data["panels"][0]["lines"][0], data["panels"][0]["lines"][3]
    assert plain["column"] == content.places["lag[1].x"]
    assert "x" not in plain
    assert data["columns"][computed["x"]]["points"] == 40
