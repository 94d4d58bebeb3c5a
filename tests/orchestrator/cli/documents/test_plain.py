"""Declared data as JSON."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from railcosim.orchestrator.cli.documents import plain, text_of


class Pair(NamedTuple):
    low: float
    high: float


@dataclass
class Told:
    values: dict
    pair: Pair


def test_every_digit_and_what_json_has_no_number_for():
    numbers = [0.1 + 0.2, 5e-324, 1e308, -0.0, 2**70]
    assert json.loads(text_of(numbers)) == numbers
    assert math.copysign(1.0, json.loads(text_of(-0.0))) == -1.0
    read = json.loads(text_of([math.nan, math.inf, -math.inf]))
    assert read == ["nan", "inf", "-inf"]
    assert [math.isnan(float(read[0])), *map(float, read[1:])] == [True, math.inf, -math.inf]


def test_declared_data_becomes_objects_and_lists():
    told = Told({None: np.float64(0.5), 2: np.array([1.0, math.nan])}, Pair(1.0, math.inf))
    assert plain(told) == {"values": {"": 0.5, "2": [1.0, "nan"]}, "pair": {"low": 1.0, "high": "inf"}}
    assert plain({"a": {"y", "x"}, "b": (True, None), "c": iter("de"), "f": np.int64(3), "p": Path("a/b")}) == (
        {"a": ["x", "y"], "b": [True, None], "c": ["d", "e"], "f": 3, "p": "a/b"}
    )
    assert plain(1j) == "1j"


def test_letters_beyond_ascii_survive_any_pipe():
    text = text_of({"title": "Zug über Brücke \udcff"})
    assert text.isascii()
    assert json.loads(text) == {"title": "Zug über Brücke \udcff"}
