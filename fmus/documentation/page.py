"""The documentation inside an FMU, from the same declarations as its description: page, signals, licences, icon."""

from __future__ import annotations

import html
import importlib.metadata
import inspect
from pathlib import Path

import numpy as np

from ...components import __name__ as _shipped
from ...components.component import Component
from ...components.declarations import State
from ...components.errors import ComponentError
from ...components.tracing import TracingError, feedthrough
from ..description import arguments
from ..kinds import NOTE_OF_KIND, FmuKind
from ..references import summary
from ..variables import scalar_variables
from .formulas import Formulas
from .reference_signals import EXCITATION, reference_signals, steps_of

_RESOURCES = Path(__file__).parents[1] / "resources"
_STYLE = (
    "body{font:15px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;width:100%}td,th{border-bottom:1px solid #ddd;padding:.2em .6em;text-align:left;"
    "vertical-align:top}code,pre{background:#f4f4f4}"
    ".note{border-left:4px solid #c60;padding:.3em 1em;background:#fff6ea}"
)


def files(component: Component, kind: FmuKind) -> dict[str, bytes]:
    """Everything an FMU holds for people, by path: ``documentation/`` with signals and licences, and ``model.png``.

    Raises:
        ComponentError: a formula that cannot be read.
    """
    signals = reference_signals(component)
    found = {"index.html": _page(component, kind, signals), **signals}
    found |= {f"licenses/{name}": text for name, text in _licences(component, kind).items()}
    archive = {f"documentation/{name}": text.encode() for name, text in found.items()}
    return archive | {"model.png": (_RESOURCES / "icon.png").read_bytes()}


def page(component: Component, kind: FmuKind) -> str:
    """The page as HTML: what the component is, its equations and source, how to step it, and its interface."""
    return _page(component, kind, reference_signals(component))


def _page(component: Component, kind: FmuKind, signals: dict[str, str]) -> str:
    cls = type(component)
    rows = "".join(
        f"<tr><td><code>{html.escape(v.name)}</code></td><td>{v.causality}</td><td>{v.variability}</td>"
        f"<td>{html.escape(v.slot.unit) if v.slot.type is float else v.slot.type.__name__}</td>"
        f"<td>{_start(component, v.slot.name, v.element) if v.causality in ('parameter', 'input') else ''}</td>"
        f"<td>{html.escape(v.description)}</td></tr>"
        for v in scalar_variables(component)
    )
    note = f'<p class="note">{html.escape(cls.note)}</p>' if cls.note else ""
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{cls.__name__}</title>'
        f"<style>{_STYLE}</style></head><body><h1>{cls.__name__}</h1><p>{html.escape(summary(cls))}</p>{note}"
        f"<pre>{html.escape(inspect.cleandoc(cls.__doc__ or ''))}</pre>{_equations(cls)}"
        f"<p>Source: {html.escape(cls.source or 'own')}. Build arguments: "
        f"<code>{html.escape(arguments(component))}</code>. Kind: {kind} ({NOTE_OF_KIND[kind]}). "
        f'<a href="licenses/license.txt">Licence</a>.</p>'
        f"<h2>Stepping</h2><ul>{''.join(f'<li>{html.escape(line)}</li>' for line in stepping(component))}</ul>"
        f"<h2>Reference signals</h2><p>{_signals(signals, steps_of(component))}</p>"
        f"<h2>Interface</h2><table><tr><th>name</th><th>causality</th><th>variability</th><th>unit or type</th>"
        f"<th>start</th><th>description</th></tr>{rows}</table></body></html>\n"
    )


def _equations(cls: type[Component]) -> str:
    if not cls.equations:
        return ""
    formulas = Formulas()
    try:
        lines = "".join(f"<p>{formulas.line(text)}</p>" for text in cls.equations)
    except ComponentError as error:
        raise ComponentError(f"{cls.__name__}.equations: {error}") from None
    return f"<h2>Equations</h2>{lines}{formulas.outlines()}"


def _start(component: Component, name: str, element: int | None) -> str:
    value = component.present_values[name]
    return html.escape(str(value if element is None else np.ravel(value)[element]))


def stepping(component: Component) -> list[str]:
    """What the importing tool must do about step and order, one sentence or two for each."""
    longest, values = type(component).recommended_step, component.present_values
    lines = [f"Recommended communication step: {longest:g} s or shorter."] if longest else []
    if component.is_sampled:
        period = values["sample_time"]
        now = f"sample_time = {period:g} s" if period else "sample_time = 0, which samples once per communication step"
        lines.append(
            "A sampled block with a clock of its own: it takes any communication step, samples when a sample is due, "
            "and holds between. Inputs are read when the communication step begins, so let it divide sample_time or be "
            f"a multiple of it; here {now}."
        )
    if any(component.of(State)):
        lines.append(
            "Continuous states are integrated by RK4 in sub-steps no longer than max_step "
            f"(here {values['max_step']:g} s) with the inputs held, so inputs are the finer the shorter the "
            "communication step."
        )
    elif not component.is_sampled:
        lines.append("Any communication step: the outputs follow from the present inputs and time alone.")
    return [*lines, _order(component)]


def _order(component: Component) -> str:
    try:
        found = feedthrough(component)
    except TracingError:
        return "Which outputs follow inputs without delay could not be found out: step it before those it acts on."
    names = {slot.name: any(found[name] for name in slot.scalars) for slot in component.output_slots}
    at_once = [name for name, direct in names.items() if direct]
    later = [name for name, direct in names.items() if not direct]
    if not at_once:
        return "No output follows an input without delay: step it after those that receive its outputs."
    return (
        f"Without delay these outputs follow inputs: {', '.join(at_once)}. Let the tool step this block before those "
        "that receive them (a controller before its train), or delay such a connection by one communication step "
        "(delay = 1 in a railcosim scenario); a tool that steps all blocks in parallel does the latter."
        + (f" Receivers of {', '.join(later)} alone may step first." if later else "")
    )


def _signals(signals: dict[str, str], steps: int) -> str:
    if not signals:
        return "None: with the start values of this build the equations refuse the usual excitation."
    links = ", ".join(f'<a href="{name}">{name}</a>' for name in sorted(signals))
    return (
        f"{links}: {steps} communication steps computed in plain Python, in the format of the FMI cross-check. "
        f"The inputs are set at the time of their row and held over the step: {EXCITATION}."
    )


def _licences(component: Component, kind: FmuKind) -> dict[str, str]:
    """The licence texts by file name; ``license.txt`` is where FMI expects the first of them."""
    cls = type(component)
    own = (_RESOURCES / "license.txt").read_text(encoding="utf-8")
    if not cls.__module__.startswith(f"{_shipped}."):
        own = f"The equations of {cls.__name__} belong to their author. What railcosim adds to them:\n\n{own}"
    if kind == "native":
        return {"license.txt": own, "fmi_headers.txt": (_RESOURCES / "fmi_headers_license.txt").read_text("utf-8")}
    shipped = importlib.metadata.files("pythonfmu") or []
    texts = {f"pythonfmu_{path.name}.txt".lower(): path.read_text() for path in shipped if "LICENSE" in path.name}
    return {"license.txt": own, **texts}
