"""Our vendor annotation in ``modelDescription.xml``: what FMI has no place for, written and read back in one file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from lxml import etree

from .kinds import NOTE_OF_KIND, FmiVersion, FmuKind

TOOL = "railcosim"


@dataclass(frozen=True)
class Annotation:
    """What one of our FMUs says about itself.

    Attributes:
        component: class name.
        arguments: build arguments by name.
        digest: hash of everything the FMU is made from.
        kind: how it is packaged; None where it does not say. kind_note: what that asks of the importing program.
        source: where the equations come from.
        note: what a user must know.
        requires: packages that it imports.
        optional_inputs: names of inputs that may stay unconnected.
        flags: for inputs that are read only where a boolean input is true, its name.
        beside: for inputs that come from where another input comes, unless they are connected, its name.
        rising: names of array parameters whose elements must rise.
        started: names of states and memory, scalars and arrays, whose start value is a parameter.
        unused_inputs: names of inputs that nothing is computed from: a port has them, this component does without.
        recommended_step: longest advisable communication step in s.
        sampled: whether it acts at samples.
    """

    component: str = ""
    arguments: Mapping[str, Any] = field(default_factory=dict)
    digest: str = ""
    kind: FmuKind | None = None
    kind_note: str = ""
    source: str = ""
    note: str = ""
    requires: tuple[str, ...] = ()
    optional_inputs: tuple[str, ...] = ()
    flags: Mapping[str, str] = field(default_factory=dict)
    beside: Mapping[str, str] = field(default_factory=dict)
    rising: tuple[str, ...] = ()
    started: tuple[str, ...] = ()
    unused_inputs: tuple[str, ...] = ()
    recommended_step: float | None = None
    sampled: bool = False


def write(annotation: Annotation, root: Any, fmi: FmiVersion = "2") -> None:
    """Add the annotation to a model description that has none, where this version of FMI has it."""
    step = annotation.recommended_step
    fields = {
        "name": annotation.component,
        "arguments": json.dumps(annotation.arguments, sort_keys=True),
        "digest": annotation.digest,
        "kind": annotation.kind or "",
        "kindNote": annotation.kind_note,
        "source": annotation.source,
        "note": annotation.note,
        "requires": " ".join(annotation.requires),
        "optionalInputs": " ".join(annotation.optional_inputs),
        "flags": json.dumps(annotation.flags) if annotation.flags else "",
        "beside": json.dumps(annotation.beside) if annotation.beside else "",
        "rising": " ".join(annotation.rising),
        "started": " ".join(annotation.started),
        "unusedInputs": " ".join(annotation.unused_inputs),
        "recommendedStep": "" if step is None else repr(float(step)),
        "sampled": "true" if annotation.sampled else "",
    }
    if fmi == "2":
        parent = etree.SubElement(etree.SubElement(root, "VendorAnnotations"), "Tool", name=TOOL)
    else:
        parent = etree.SubElement(etree.SubElement(root, "Annotations"), "Annotation", type=TOOL)
    etree.SubElement(parent, "component", **{name: value for name, value in fields.items() if value})


def read(root: Any) -> Annotation | None:
    """The annotation in a model description; None in one of another maker.

    Raises:
        ValueError: build arguments that are not JSON, or a step that is no number.
    """
    places = (f"VendorAnnotations/Tool[@name='{TOOL}']", f"Annotations/Annotation[@type='{TOOL}']")
    element = next((found for place in places if (found := root.find(f"{place}/component")) is not None), None)
    if element is None:
        return None
    step, arguments = element.get("recommendedStep"), json.loads(element.get("arguments", "{}"))
    return Annotation(
        component=element.get("name", ""),
        arguments=arguments if isinstance(arguments, dict) else {},
        digest=element.get("digest", ""),
        kind=next((kind for kind in NOTE_OF_KIND if kind == element.get("kind")), None),
        kind_note=element.get("kindNote", ""),
        source=element.get("source", ""),
        note=element.get("note", ""),
        requires=tuple(element.get("requires", "").split()),
        optional_inputs=tuple(element.get("optionalInputs", "").split()),
        flags=_names(element.get("flags", "{}")),
        beside=_names(element.get("beside", "{}")),
        rising=tuple(element.get("rising", "").split()),
        started=tuple(element.get("started", "").split()),
        unused_inputs=tuple(element.get("unusedInputs", "").split()),
        recommended_step=float(step) if step else None,
        sampled=element.get("sampled") == "true",
    )


def _names(text: str) -> dict[str, str]:
    told = json.loads(text)
    return {str(k): str(v) for k, v in told.items()} if isinstance(told, dict) else {}
