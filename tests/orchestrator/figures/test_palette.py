"""One colour a thing, wherever it is drawn."""

from railcosim.orchestrator.figures import COLOURS, draw

SPEED, GAP = "train[:].speed", "train[i-1].position - train[i].position"


def colours(ax):
    return {line.get_label(): line.get_color() for line in ax.lines}


def test_a_gap_has_the_colour_of_the_train_behind_it(drawn):
    speeds, gaps, stacked = map(
        colours, drawn(panels=[{"y": [SPEED]}, {"y": [GAP]}, {"y": ["train[1:2].position - train[2:3].position"]}])
    )
    assert gaps == {"train 1–2": speeds["train 2"], "train 2–3": speeds["train 3"]}
    assert stacked == gaps


def test_numbers_of_cars_and_of_trains_are_things_apart(drawn):
    trains, cars = map(colours, drawn(panels=[{"y": [SPEED]}, {"y": ["consist[:].force[:]"]}]))
    assert len(set(trains.values())) == 3
    assert len(set(cars.values())) == 4


def test_numbers_that_all_lines_of_an_entry_share_tell_nothing(drawn):
    """The cars of one consist are cars as those of the other; the first car of each consist stands for the consist."""
    first, second = map(colours, drawn(panels=[{"y": [f"consist[{k}].force[:]"]} for k in (1, 2)]))
    assert list(first.values()) == list(second.values()) == list(COLOURS[:2])
    trains, heads = map(colours, drawn(panels=[{"y": ["train[1:2].speed"]}, {"y": ["consist[:].force[1]"]}]))
    assert list(trains.values()) == list(heads.values())


def test_more_things_than_colours_are_told_apart_along_a_scale(drawn):
    every, some = map(colours, drawn(panels=[{"y": ["car[:].speed"]}, {"y": ["car[1:3].speed"]}]))
    assert some.items() <= every.items()
    assert len({str(colour) for colour in every.values()}) == 12


def test_a_name_keeps_its_colour_in_panels_and_figures(recorded, tmp_path, monkeypatch):
    from matplotlib.figure import Figure

    kept = []
    monkeypatch.setattr(Figure, "savefig", lambda self, *_, **__: kept.append([colours(ax) for ax in self.axes]))
    signals = {
        "reference": "target.value",
        "limit": "train[3].speed",
        "law": "train[1].speed",
        "other": "train[2].speed",
    }

    def panel(*names):
        return {"y": [signals[name] for name in names], "label": list(names)}

    figures = [
        {"title": "A", "panels": [panel("reference", "limit", "law"), panel("law", "other")]},
        {"title": "B", **panel("other", "law")},
        {"title": "C", **panel("other")},
    ]
    draw(figures, recorded, tmp_path)
    of = {name: colour for panels in kept for panel in panels for name, colour in panel.items()}
    assert all(panel.items() <= of.items() for panels in kept for panel in panels)
    assert len(set(of.values())) == 4
