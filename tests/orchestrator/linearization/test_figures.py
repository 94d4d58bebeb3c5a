"""Figures of linear models: what their axes say."""

from dataclasses import replace

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
    labels = {}

    def keep(figure, path, **_):
        labels[path.name] = [ax.get_ylabel() for ax in figure.axes]

    monkeypatch.setattr(Figure, "savefig", keep)
    model = replace(
        a_model([[-1.0]], [1.0], [1.0], outputs=["train.speed"]), units={"train.speed": "m/s", "u0": "m/s2"}
    )
    draw_linear(model, stability(model), [], tmp_path)
    assert labels["bode.png"] == ["train speed\n|G| [s]", "phase [°]"]
    assert labels["step-u0.png"] == ["train speed [m/s]"]
