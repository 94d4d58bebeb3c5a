"""A model description as it is written, of any version: its variables one by one, the rest by FMPy."""

from __future__ import annotations

import copy
import io
import zipfile
from array import array
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from fmpy.model_description import read_model_description
from lxml import etree

from ..errors import FmuFileError
from .document import Schema, parse, sections
from .entries import Description, Entry, Texts, problems, read_entry, resolve
from .repair import Faults, Repair
from .translation import VERSIONS, is_for_co_simulation, other_kind, restructure, standard

_VARIABLES, _STRUCTURE = "ModelVariables", "ModelStructure"
_OUTPUTS = {"2.0": ("ModelStructure/Outputs", "Unknown", "index"), "3.0": (_STRUCTURE, "Output", "valueReference")}
"""By version: where outputs are listed, as which elements, and by what they say which variable they are."""

_OF_TYPES = {
    "name",
    "description",
    "quantity",
    "unit",
    "displayUnit",
    "relativeQuantity",
    "min",
    "max",
    "nominal",
    "unbounded",
}
"""Attributes of types that FMPy reads."""


def read(path: Path, name: str, *, mending: bool = True, structure: Mapping[str, Any] | None = None) -> Reading:
    """Read a file.

    Args:
        path: the file.
        name: the FMU as the user knows it, for messages.
        mending: whether what tools get wrong is put right.
        structure: values of structural parameters by name, in place of those in the file.

    Raises:
        FmuFileError: it is none of a co-simulation FMU of a version that is known.
        Exception: it cannot be used.
    """
    reading = Reading(name, mending=mending, structure=structure)
    reading.take_all(path)
    if reading.is_late:
        reading = Reading(name, mending=mending, structure=structure, before=reading)
        reading.take_all(path)
    return reading


class Reading:
    """What is read of a file, part by part.

    Args:
        name: the FMU as the user knows it, for messages.
        mending: whether what tools get wrong is put right.
        structure: values of structural parameters by name.
        before: a reading of the whole file, where what is referred to comes after what refers.

    Attributes:
        version: of FMI. root: the document without variables and model structure. description: what it says.
    """

    description: Description
    root: Any
    _schema: Schema

    def __init__(
        self, name: str, *, mending: bool, structure: Mapping[str, Any] | None, before: Reading | None = None
    ) -> None:
        self.version = ""
        self._structure = structure or {}
        self._name, self._is_mending = name, mending
        self._is_last = before is not None
        self._repair: Repair = Repair(None if before is None else before._repair)
        self._overlooked = Faults()
        self._has_parts = False
        self._taken: set[str] = set()
        self._entries: list[Entry] = []
        self._texts = Texts()
        self._outputs = array("q")
        """Which variables the outputs are, by place from 1 (FMI 2.0) or reference (3.0)."""
        self._depend: list[str | None] = []
        """What each depends on directly, as it is written."""

    def take_all(self, path: Path) -> None:
        """Read the file."""
        self.root, overlooked = parse(path, self._name, self._take_part)
        root = self.root
        self._overlooked.add(overlooked)
        self._begin(root)
        if not is_for_co_simulation(root, self.version):
            other = other_kind(root, self.version)
            raise FmuFileError(f"{self._name} has no co-simulation part{f' (it is {other})' if other else ''}")
        if self._is_mended:
            self._repair.end(root)
        self._take_rest(root, _VARIABLES)
        for section, _ in list(sections(root)):
            if section != _VARIABLES:
                self._take_rest(root, section)
        self._schema.check(root.getroottree())
        self._is_late = self._has_parts and not self._is_last and _refers_ahead(root)
        for parent in filter(lambda it: it is not None, map(root.find, (_VARIABLES, _STRUCTURE))):
            del parent[:]
        self.description = Description(_read_rest(root), self._entries)
        if self._is_mended:
            for entry in self._entries:
                self._repair.take_derivative(entry)
        self._resolve()

    @property
    def is_late(self) -> bool:
        """Whether parts were taken before something was known that they refer to."""
        return self._is_late

    @property
    def _is_mended(self) -> bool:
        return self._is_mending and self.version == "2.0"

    @property
    def faults(self) -> Faults:
        """What was overlooked or put right."""
        every = Faults()
        every.join(self._overlooked)
        every.join(self._repair.faults)
        return every

    def problems(self) -> Iterable[str]:
        """What is wrong all the same, a sentence each: with the form or, if that is kept, with what is written."""
        return self.against_schema or self.inconsistencies()

    @property
    def against_schema(self) -> list[str]:
        """What is wrong with the form."""
        return self._schema.problems

    def inconsistencies(self) -> Iterable[str]:
        """What is wrong with variables that keep the form, before they are translated."""
        return problems(self._entries, self.description.found, self.version)

    def _begin(self, root: Any) -> None:
        """What must be known before any part is read."""
        if self.version:
            return
        version = standard(root)
        if version not in VERSIONS:
            known = ", ".join(VERSIONS)
            raise FmuFileError(
                f"{self._name} is FMI {version}; this version of railcosim runs co-simulation FMUs of FMI {known}"
            )
        self.version, self._schema = version, Schema(version)

    def _take_part(self, root: Any, section: str, elements: list[Any]) -> None:
        self._begin(root)
        self._has_parts = True
        if section != _VARIABLES:  # which are all there, if they stand before it
            self._take_rest(root, _VARIABLES)
        self._schema.check_part(section, self._take(root, section, elements))

    def _take_rest(self, root: Any, section: str) -> None:
        """Read what has been left of a section, once."""
        parent = root.find(section)
        if parent is not None and section not in self._taken:
            self._taken.add(section)
            self._take(root, section, [element for element in parent if isinstance(element.tag, str)])

    def _take(self, root: Any, section: str, elements: list[Any]) -> list[Any]:
        """Read elements of a section; those that are left of them."""
        if section == _VARIABLES:
            if self._is_mended:
                self._repair.begin(root)
                elements = self._repair.take_variables(elements)
            named = (element for element in elements if element.get("name") is not None)
            self._entries += [read_entry(element, self.version, self._texts) for element in named]
        elif self._is_mended and section != _STRUCTURE:
            elements = self._repair.take_unknowns(section.rpartition("/")[2], elements)
        path, tag, key = _OUTPUTS.get(self.version, ("", "", ""))
        for element in elements if section == path else ():
            if element.tag == tag:
                self._outputs.append(int(element.get(key)))
                depend = element.get("dependencies")
                self._depend.append(None if depend is None else self._texts[depend])
        return elements

    def _resolve(self) -> None:
        """Put names in the place of references."""
        entries = self._entries
        by_number = dict(enumerate(entries, 1)) if self.version == "2.0" else {e.reference: e for e in entries}
        known: dict[str | None, frozenset[str] | None] = {None: None}
        for number, depend in zip(self._outputs, self._depend, strict=True):
            if depend not in known:
                known[depend] = frozenset(by_number[int(one)].name for one in (depend or "").split())
            by_number[number].depends = known[depend]
        del by_number, self._outputs, self._depend
        restructure(entries, self._structure, self._name)
        resolve(entries, self.version)


def _refers_ahead(root: Any) -> bool:
    """Whether what variables or the model structure refer to stands behind them."""
    order = {child.tag: place for place, child in enumerate(root)}
    variables = order.get(_VARIABLES, 0)
    defined = max(order.get(tag, 0) for tag in ("UnitDefinitions", "TypeDefinitions"))
    return defined > variables or order.get(_STRUCTURE, variables) < variables


def _read_rest(root: Any) -> Any:
    """What FMPy makes of everything else, out of an archive in memory.

    Of types it is given the attributes that it knows: those of binary values and clocks it cannot read.
    """
    archive, root = io.BytesIO(), copy.deepcopy(root)
    for made in root.iterfind("TypeDefinitions/*"):
        for key in set(made.attrib) - _OF_TYPES:
            del made.attrib[key]
    with zipfile.ZipFile(archive, "w") as stream:
        stream.writestr("modelDescription.xml", etree.tostring(root, encoding="UTF-8", xml_declaration=True))
    return read_model_description(archive, validate=False)
