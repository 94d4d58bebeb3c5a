"""Rows become columns of the kinds that they have, whatever part of the study they come from."""

import math

import numpy as np
import pyarrow as pa
import pytest
from railcosim.orchestrator.study import Row
from railcosim.orchestrator.study.campaign.columns import Entry, fitted, tabulated, tabulated_series, unified

DONE = Row("completed", metrics={"end[2]": 0.1 + 0.2, "most": math.inf}, verdicts={"low": "pass"}, margins={"low": 0.5})
LOST = Row("failed", "it broke", seconds=0.5)
SCALED = Row("completed", metrics={"end[10]": 1.0}, scaled={"low": 0.25}, steps=7)


def parts(*groups, dimensions=("lag.rate",)):
    tables = [tabulated(group, dimensions, 5) for group in groups]
    schema = unified([table.schema for table in tables], dimensions, ["end", "most", "low"])
    return pa.concat_tables([fitted(table, schema) for table in tables]).unify_dictionaries()


def test_a_table_is_sorted_and_has_every_run_once():
    table = parts([Entry(3, {"lag.rate": 2.0, "simulation.seed": 9}, DONE), Entry(1, {"lag.rate": 1.0}, LOST)])
    assert table.column_names == (
        [
            "run",
            "lag.rate",
            "seed",
            "status",
            "error",
            "seconds",
            "steps",
            "metric.end[2]",
            "metric.most",
            "verdict.low",
            "margin.low",
        ]
    )
    assert table["run"].to_pylist() == [1, 3]
    assert table["seed"].to_pylist() == [5, 9]
    assert table["error"].to_pylist() == ["it broke", ""]
    assert table["metric.end[2]"].to_pylist()[1] == 0.1 + 0.2
    assert math.isnan(table["metric.most"].to_pylist()[0])
    assert table["verdict.low"].to_pylist() == [None, "pass"]


def test_parts_that_differ_fit_together():
    table = parts([Entry(0, {"lag.rate": 1}, DONE)], [Entry(1, {"lag.rate": 0.5}, SCALED)], [Entry(2, {}, LOST)])
    assert table.column_names[7:] == (
        ["metric.end[2]", "metric.end[10]", "metric.most", "verdict.low", "margin.low", "robustness.low"]
    )
    assert table["lag.rate"].to_pylist() == [1.0, 0.5, None]
    assert table["metric.end[10]"].to_pylist() == [None, 1.0, None]


@pytest.mark.parametrize(
    ("values", "kind", "found"),
    [
        ([1, 2], pa.int64(), [1, 2]),
        ([1, 2.5], pa.float64(), [1.0, 2.5]),
        ([True, None], pa.bool_(), [True, None]),
        (["a", "b"], pa.string(), ["a", "b"]),
        ([[1, 2], "a"], pa.string(), ["[1, 2]", "a"]),
        ([True, 2], pa.string(), ["true", "2"]),
        ([None, None], pa.null(), [None, None]),
    ],
)
def test_values_of_a_dimension(values, kind, found):
    whole = parts([Entry(k, {"lag.rate": value}, LOST) for k, value in enumerate(values)])["lag.rate"]
    assert (whole.type, whole.to_pylist()) == (kind, found)
    single = parts(*([Entry(k, {"lag.rate": value}, LOST)] for k, value in enumerate(values)))["lag.rate"]
    assert (single.type, single.to_pylist()) == (kind, found)


def test_an_empty_study_has_its_columns():
    assert unified([], ["lag.rate"], []).names == ["run", "lag.rate", "seed", "status", "error", "seconds", "steps"]


def test_series_are_rows_of_points():
    one = Row("completed", series={"time": np.array([0.0, 1.0]), "lag.x": np.array([1.0, 0.5])})
    table = tabulated_series([Entry(4, {}, one), Entry(2, {}, LOST)])
    assert table.to_pydict() == {"run": [4, 4], "time": [0.0, 1.0], "lag.x": [1.0, 0.5]}
    assert tabulated_series([Entry(2, {}, LOST)]) is None
