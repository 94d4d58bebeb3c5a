"""Figures of linear models: what their axes say."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from railcosim.orchestrator.linearization.figures import draw_linear, unit_of_ratio
from railcosim.orchestrator.linearization.modes import stability


@pytest.mark.parametrize(
    ("output", "input", "ratio"),
    [
        ("m/s", "m/s2", "s"),
        ("m", "m/s2", "s2"),
        ("m/s", "m/s", "1"),
        ("m/s2", "N", "1/kg"),
        ("N", "m/s", "kg/s"),
        ("1", "m", "1/m"),
        ("", "m.s", "1/(m.s)"),
        ("m", "", "m"),
        ("km", "m", "(km)/(m)"),
        ("furlong", "m", "(furlong)/(m)"),
    ],
)
def test_a_ratio_has_the_unit_of_output_over_input(output, input, ratio):
    assert unit_of_ratio(output, input) == ratio


def test_a_bode_diagram_has_the_unit_of_output_over_input(a_model, tmp_path, monkeypatch):
    """A lag of a speed behind an acceleration: |G| is in seconds, though the speed itself is not."""
    kept = []

    def keep(figure, *_, **__):
        kept.append([ax.get_ylabel() for ax in figure.axes])

    monkeypatch.setattr(Figure, "savefig", keep)
    model = replace(
        a_model([[-1.0]], [1.0], [1.0], outputs=["train.speed"]), units={"train.speed": "m/s", "u0": "m/s2"}
    )
    paths = draw_linear(model, stability(model), [], tmp_path)
    labels = {path.name: shown for path, shown in zip(paths, kept, strict=True)}
    assert labels["bode.png"] == ["train speed\n|G| [s]", "phase [°]"]
    assert labels["step-u0.png"] == ["train speed [m/s]"]


def test_figures_are_written_in_the_format_asked_for(a_model, tmp_path):
    model = a_model([[-1.0]], [1.0], [1.0], outputs=["train.speed"])
    paths = draw_linear(model, stability(model), [], tmp_path, format="svg", dpi=50.0)
    assert [path.name for path in paths] == ["eigenvalues.svg", "step-u0.svg", "bode.svg"]
    assert all(path.read_text(encoding="utf-8").startswith("<?xml") for path in paths)


def test_a_gap_has_the_colour_of_the_train_behind_it_in_all_panels(a_model, tmp_path, monkeypatch):
    kept = []

    def keep(figure, *_, **__):
        kept.append([{line.get_label(): line.get_color() for line in ax.lines} for ax in figure.axes])

    monkeypatch.setattr(Figure, "savefig", keep)
    names = [f"train[{i}].{what}" for what in ("position", "speed") for i in (1, 2, 3)]
    model = a_model(-np.eye(6), [1.0] * 6, np.eye(6), outputs=names)
    names = [path.name for path in draw_linear(model, stability(model), [], tmp_path)]
    gaps, speeds = kept[names.index("step-u0.png")]
    assert gaps == {"train 1 – 2": speeds["train 2"], "train 2 – 3": speeds["train 3"]}
    assert len(set(speeds.values())) == 3
