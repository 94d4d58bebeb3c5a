"""Trajectories of Dymola and OpenModelica: MATLAB files of level 4 with certain matrices."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .table import Table, refused

_UNIT = re.compile(r"\[([^\[\]|]+)(?:\|[^\[\]]*)?\]\s*$")
"""How a description ends: ``speed of the train [m/s]``, or with a unit for display, ``[m/s|km/h]``."""


def read_dymola(path: Path) -> Table:
    """The variables of a trajectory; what is constant in it is so at all points.

    Args:
        path: of the file, of version 1.1 (``binTrans`` or ``binNormal``) or 1.0.

    Raises:
        OSError, ValueError, LookupError: it cannot be read.
    """
    from scipy.io import loadmat

    try:
        found = loadmat(path, chars_as_strings=False)
    except Exception as error:  # SciPy has its own, and NotImplementedError for MATLAB 7.3
        raise refused(path, error) from error
    if "Aclass" not in found:
        raise refused(path, "it is a MATLAB file, but no trajectory of Dymola or OpenModelica")
    about = _texts(found["Aclass"])
    if about[1] == "1.0":
        return Table(dict(zip(_texts(found["names"]), found["data"].T, strict=True)))
    turned = about[3] == "binTrans"
    names, descriptions = (_texts(found[key].T if turned else found[key]) for key in ("name", "description"))
    told = found["dataInfo"].T if turned else found["dataInfo"]
    blocks = {key: found[key] if turned else found[key].T for key in found if re.fullmatch(r"data_\d+", key)}
    last = max(blocks, key=lambda key: blocks[key].shape[1])  # the other holds what is constant, at begin and end
    count = blocks[last].shape[1]
    columns: dict[str, NDArray[Any]] = {}
    for name, (block, place, *_) in zip(names, told.tolist(), strict=True):
        row = blocks[f"data_{block}" if block else last][abs(place) - 1]
        values = row if len(row) == count else np.full(count, row[0])
        columns[name] = -values if place < 0 else values
    units = {name: match[1] for name, text in zip(names, descriptions, strict=True) if (match := _UNIT.search(text))}
    return Table(columns, units)


def _texts(letters: NDArray[Any]) -> list[str]:
    """The rows of a matrix of letters; their bytes are UTF-8 by now, and were Latin letters once."""
    lines = ("".join(row.tolist()).rstrip(" \0") for row in letters)
    return [_decoded(line) for line in lines]


def _decoded(line: str) -> str:
    try:
        return line.encode("latin-1").decode()
    except UnicodeError:
        return line
