"""Metrics as a table, on wide and narrow terminals."""

import math
import re

from railcosim.orchestrator.cli.printing.metrics import show_metrics
from railcosim.orchestrator.evaluation import Metric, MetricChange

GAPS = Metric("gap", "final(x)", {2: 17.3125, 3: 16.646}, "m")


def test_single_values_stand_one_a_row_and_indexed_ones_side_by_side(shown):
    lines = shown(show_metrics, [Metric("settling", "s(x)", {None: 138.7}, "s"), GAPS])
    assert [line.split() for line in lines if line] == [
        ["Metrics"],
        ["metric", "value", "unit"],
        ["settling", "138.7", "s"],
        ["Metrics", "by", "index"],
        ["metric", "[2]", "[3]", "unit"],
        ["gap", "17.3125", "16.646", "m"],
    ]


def test_on_a_narrow_terminal_indexed_values_stand_below_one_another(shown):
    lines = shown(show_metrics, [Metric("gap", "final(x)", dict.fromkeys(range(1, 9), 17312.5), "m")], width=50)
    assert [line.split() for line in lines[1:4]] == [
        ["Metrics"],
        ["metric", "value", "unit"],
        ["gap[1]", "17312.5", "m"],
    ]
    assert any(line.split() == ["gap[8]", "17312.5", "m"] for line in lines)


def test_a_value_is_never_an_unexplained_nan_or_inf(shown):
    late = Metric("settling", "s(x, until = 9)", {None: math.inf}, "s")
    lost = Metric("gap", "g(x)", {None: math.nan}, "", problem="'g(x)': the window lasts until 9 s")
    text = "\n".join(shown(show_metrics, [late, lost]))
    assert re.search(r"settling +never +s", text)
    assert re.search(r"gap +-$", text, re.MULTILINE)
    assert "no value: the window lasts until 9 s (gap)" in text
    assert "nan" not in text
    assert "inf" not in text


def test_comfort_is_shown_with_its_levels_under_the_sources_own_words(shown):
    text = "\n".join(shown(show_metrics, [Metric("peak", "c(x)", {1: 0.595, 2: 0.937}, "m/s2", comfort=True)]))
    assert "0.595 (2, 3)" in text
    assert "0.937 (3, 4)" in text
    assert "quasi-static acceleration compared with the ISO 2631-1 reaction scale (as in the source)" in text


def test_a_comparison_stands_beside_each_value(shown):
    lines = shown(show_metrics, [GAPS], [MetricChange("gap", 2, 17.3125, 17.3, "m")])
    assert ["gap[2]", "17.3125", "17.3", "-0.0125", "m"] in [line.split() for line in lines]
    assert ["gap[3]", "16.646", "m"] in [line.split() for line in lines]


def test_large_energies_and_forces_take_a_prefix(shown):
    energy = Metric("energy", "e(x)", {1: 14.117e9, 2: 990.0}, "J")
    changes = [MetricChange("energy", 1, 14.117e9, 14.118e9, "J")]
    rows = [line.split() for line in shown(show_metrics, [energy], changes)]
    assert ["energy[1]", "14.117", "14.118", "+0.001", "GJ"] in rows
    assert ["energy[2]", "9.9e-07", "GJ"] in rows
    units = {"J": "990", "m": "990000", "kg": "400000"}
    for unit, value in units.items():
        assert ["x", value, unit] in [
            line.split() for line in shown(show_metrics, [Metric("x", "", {None: float(value)}, unit)])
        ]
    assert ["x", "1.2", "kN"] in [line.split() for line in shown(show_metrics, [Metric("x", "", {None: 1200.0}, "N")])]
    assert ["x", "never", "s"] in [
        line.split() for line in shown(show_metrics, [Metric("x", "", {None: math.inf}, "s")])
    ]
