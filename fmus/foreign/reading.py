"""A data file of any known format: this project's own as it stands, a foreign one read into it."""

from __future__ import annotations

import csv
import io
import json
import logging
from typing import Any

from . import onnx_network, railml, ttobench
from .quantities import ForeignError

_LOG = logging.getLogger(__name__)
DATA_SUFFIXES = (".csv", ".json", ".railml", ".xml", ".onnx")
"""How the names of data files end."""


def read_data(path: str, content: bytes) -> Any:
    """What a data file holds, in this project's format; what is to be known of a foreign one is logged as a warning.

    Args:
        path: for messages, and its suffix tells what it is: JSON, railML, ONNX, or a table as CSV.
        content: of the file.

    Raises:
        ForeignError: a foreign file has a missing or unusable value; the message names its key.
        ValueError: it is not JSON.
    """
    if path.endswith(".onnx"):
        return onnx_network.read(content)
    if path.endswith(".csv"):
        return _table(content)
    if path.endswith(".json"):
        data = json.loads(content.decode("utf-8"))
        if not ttobench.is_ttobench(data):
            return data
        made, told = ttobench.read(data)
    else:
        made, told = railml.read(content)
    for warning in told:
        _LOG.warning("%s: %s", path, warning)
    return made


def _table(content: bytes) -> list[dict[str, float]]:
    """Rows of numbers by the names in the first line.

    Raises:
        ForeignError: a row has more or fewer values, or one that is no number.
    """
    rows = list(csv.DictReader(io.StringIO(content.decode("utf-8", "replace"))))
    made = []
    for number, row in enumerate(rows, 2):
        try:
            made.append({name: float(value) for name, value in row.items()})
        except (TypeError, ValueError):
            raise ForeignError(f"line {number} is not a number for each column of the first line") from None
    return made
