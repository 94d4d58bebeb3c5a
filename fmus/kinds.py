"""The kinds of models: what a component can become, and what a user asks for."""

from __future__ import annotations

from typing import Literal

FmuKind = Literal["native", "python"]
"""What a component is packaged as: compiled C, or its Python behind a wrapper."""
PackagingKind = Literal["auto", "native", "python"]
"""What a user asks for where an FMU is to be made: ``"auto"`` is native where that is possible."""
Kind = Literal["auto", "native", "python", "plain"]
"""What a user asks for where a system is to run: ``"plain"`` is Python objects without packaging."""
Profile = Literal["standard", "real-time", "model-exchange"]
"""What a native FMU's C may and can do: ``"real-time"`` is no file, no memory taken after instantiation, no printf;
``"model-exchange"`` can be integrated by others as well."""
FmiVersion = Literal["2", "3"]
"""The version of FMI that an FMU is written in: 2.0 or 3.0."""
ModelKind = Literal["fmu", "native", "python", "plain"]
"""What a model is: ``"fmu"`` a file that the user gave, the others made here of a component."""

KINDS: tuple[Kind, ...] = ("auto", "native", "python", "plain")

NOTE_OF_KIND: dict[FmuKind, str] = {
    "python": "runs in the importing process's Python: needs Python 3.11+ and NumPy there",
    "native": "compiled C: needs nothing but the C library",
}
