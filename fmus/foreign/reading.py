"""A data file of any known format: this project's own as it stands, a foreign one read into it."""

from __future__ import annotations

import json
import logging
from typing import Any

from . import onnx_network, railml, ttobench

_LOG = logging.getLogger(__name__)
DATA_SUFFIXES = (".json", ".railml", ".xml", ".onnx")
"""How the names of data files end."""


def read_data(path: str, content: bytes) -> Any:
    """What a data file holds, in this project's format; what is to be known of a foreign one is logged as a warning.

    Args:
        path: for messages, and its suffix tells railML and ONNX from JSON.
        content: of the file.

    Raises:
        ForeignError: a foreign file has a missing or unusable value; the message names its key.
        ValueError: it is not JSON.
    """
    if path.endswith(".onnx"):
        return onnx_network.read(content)
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
