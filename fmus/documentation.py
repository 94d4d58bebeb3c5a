"""The documentation page inside an FMU, from the same declarations as its description."""

from __future__ import annotations

import html
import inspect

import numpy as np

from ..components.component import Component
from .description import NOTE_OF_KIND, Kind, arguments, summary
from .variables import scalar_variables

_STYLE = (
    "body{font:15px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;width:100%}td,th{border-bottom:1px solid #ddd;padding:.2em .6em;text-align:left;"
    "vertical-align:top}code,pre{background:#f4f4f4}"
    ".note{border-left:4px solid #c60;padding:.3em 1em;background:#fff6ea}"
)


def page(component: Component, kind: Kind) -> str:
    """The page as HTML: what the component is, its source, its interface, and how to step it."""
    cls = type(component)
    rows = "".join(
        f"<tr><td><code>{html.escape(v.name)}</code></td><td>{v.causality}</td><td>{v.variability}</td>"
        f"<td>{html.escape(v.slot.unit) if v.slot.type is float else v.slot.type.__name__}</td>"
        f"<td>{_start(component, v.slot.name, v.element) if v.causality in ('parameter', 'input') else ''}</td>"
        f"<td>{html.escape(v.slot.declaration.description)}</td></tr>"
        for v in scalar_variables(component)
    )
    note = f'<p class="note">{html.escape(cls.note)}</p>' if cls.note else ""
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{cls.__name__}</title>'
        f"<style>{_STYLE}</style></head><body><h1>{cls.__name__}</h1><p>{html.escape(summary(cls))}</p>{note}"
        f"<pre>{html.escape(inspect.cleandoc(cls.__doc__ or ''))}</pre>"
        f"<p>Source: {html.escape(cls.source or 'own')}. Build arguments: "
        f"<code>{html.escape(arguments(component))}</code>. Kind: {kind} ({NOTE_OF_KIND[kind]}).</p>"
        f"<h2>Stepping</h2><p>{html.escape(_stepping(component))}</p>"
        f"<h2>Interface</h2><table><tr><th>name</th><th>causality</th><th>variability</th><th>unit or type</th>"
        f"<th>start</th><th>description</th></tr>{rows}</table></body></html>\n"
    )


def _start(component: Component, name: str, element: int | None) -> str:
    value = component.__dict__[name]
    return html.escape(str(value if element is None else np.ravel(value)[element]))


def _stepping(component: Component) -> str:
    longest = type(component).recommended_step
    advice = f"Recommended communication step: {longest:g} s or shorter. " if longest else ""
    if component.is_sampled:
        return advice + "A sampled block: the communication step must be a whole multiple of sample_time."
    return advice + "Any communication step; states are integrated by RK4 in sub-steps no longer than max_step."
