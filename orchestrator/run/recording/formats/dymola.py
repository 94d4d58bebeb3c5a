"""Trajectories of Dymola and OpenModelica: MATLAB files of level 4 with certain matrices."""

from __future__ import annotations

import re
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from .... import world
from ....evaluation import Signals
from .table import TIME, Table, blocks_of, numbers_among, refused

_UNIT = re.compile(r"\[([^\[\]|]+)(?:\|[^\[\]]*)?\]\s*$")
"""How a description ends: ``speed of the train [m/s]``, or with a unit for display, ``[m/s|km/h]``."""
_DOUBLES, _WHOLE, _LETTERS = 0, 20, 51
"""What a matrix holds, as level 4 numbers it, least byte first."""


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


def write_dymola(path: Path, signals: Signals) -> None:
    """A trajectory of version 1.1, ``binTrans``, with the parameters. Texts find no place in it.

    Args:
        path: of the file.
        signals: what it is to hold.
    """
    names = numbers_among(signals)
    fixed = {name: float(value) for name, value in signals.parameters.items() if not isinstance(value, str)}
    units = {TIME: "s", **signals.units}
    called = ["Time" if name == TIME else name for name in [*names, *fixed]]
    described = [f"[{units[name]}]" if name in units else "" for name in [*names, *fixed]]
    told = [(2 if k else 0, k + 1, 0, -1) for k in range(len(names))]
    told += [(1, k + 2, 0, 0) for k in range(len(fixed))]
    ends = [float(signals.part(k, k + 1)[TIME][0]) for k in (0, signals.points - 1)]
    with world.open(path, "wb") as stream:
        _letters(stream, "Aclass", ["Atrajectory", "1.1", "", "binTrans"], turned=False)
        _letters(stream, "name", called)
        _letters(stream, "description", described)
        _head(stream, "dataInfo", _WHOLE, 4, len(told))
        stream.write(np.array(told, "<i4").tobytes())
        _head(stream, "data_1", _DOUBLES, 1 + len(fixed), 2)
        for time in ends:
            stream.write(np.array([time, *fixed.values()], "<f8").tobytes())
        _head(stream, "data_2", _DOUBLES, len(names), signals.points)
        for columns in blocks_of(signals, names):
            stream.write(np.ascontiguousarray(np.column_stack(columns), "<f8").data)


def _head(stream: IO[bytes], name: str, kind: int, rows: int, columns: int) -> None:
    stream.write(struct.pack("<5i", kind, rows, columns, 0, len(name) + 1) + name.encode() + b"\0")


def _letters(stream: IO[bytes], name: str, texts: Sequence[str], *, turned: bool = True) -> None:
    """A matrix of letters with a text in each column, or in each row. Matrices stand column by column."""
    lines = [text.encode() for text in texts]
    width = max(1, *map(len, lines))
    table = np.frombuffer(b"".join(line.ljust(width) for line in lines), np.uint8).reshape(-1, width)
    _head(stream, name, _LETTERS, *((width, len(lines)) if turned else (len(lines), width)))
    stream.write((table if turned else np.ascontiguousarray(table.T)).tobytes())
