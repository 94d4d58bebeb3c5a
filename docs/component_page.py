"""A component's page, in Markdown, from the declarations that its FMU's description comes from.

A figure is drawn from the component alone, simulated in plain Python: as ``experiments.toml`` says, and otherwise under
the excitation that the FMU's reference signals have.
"""

from __future__ import annotations

import functools
import inspect
import io
import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from railcosim import components, models
from railcosim.components import CATALOGUE, Component, Simulation, simulate
from railcosim.components.component import Slot
from railcosim.components.declarations import Data, Input, Memory, Output, Parameter, Size, State
from railcosim.components.tracing import TracingError, feedthrough
from railcosim.fmus.description import default_step
from railcosim.fmus.documentation import stepping
from railcosim.fmus.documentation.reference_signals import EXCITATION, STEPS, reference_signals
from railcosim.fmus.references import summary

EXPERIMENTS = tomllib.loads((Path(__file__).parent / "experiments.toml").read_text(encoding="utf-8"))
_COLOURS = ("#3f7fd0", "#d9772b", "#2f9e63", "#b0559e", "#b8952a", "#5ba7b5")
"""Of curves: of a lightness that reads on white and on black."""
_POINTS = 201
"""Of a characteristic."""
_LONGEST = 60
"""Characters of a start value that a table shows."""


# ---------------------------------------------------------------- the page


def page(cls: type[Component], catalogue: Mapping[str, type[Component]] = CATALOGUE) -> str:
    """The page of a component: what it is, its figure, equations and interface, and what can stand in its place."""
    component = cls()
    note = f'!!! note "To know"\n\n    {cls.note}\n\n' if cls.note else ""
    story = inspect.cleandoc(cls.__doc__ or "").partition("\n\n")[2]
    figure, caption = draw(component)
    parts = [
        f"# {cls.__name__}\n\n{summary(cls)}\n\n{note}{story}\n\n**Source:** {cls.source or 'own'}.\n",
        f'<figure class="signals" markdown="0">{figure}<figcaption>{caption}</figcaption></figure>\n',
        _section("Equations", "\n\n".join(cls.equations)),
        _section("Inputs", _inputs(component)),
        _section("Outputs", _outputs(component)),
        _section("Parameters", _parameters(component)),
        _section("States and memory", _kept(component)),
        _section("Build arguments", _build_arguments(component)),
        _section("Stepping", "\n".join(f"- {line}" for line in stepping(component))),
        _section("What swaps with it", _swaps(cls, catalogue)),
    ]
    return "\n".join(part for part in parts if part)


def family(cls: type[Component]) -> str:
    """The folder its equations stand in: trains, cruise, ato, supervision, environment."""
    return cls.__module__.removeprefix(f"{components.__name__}.").split(".")[0]


def port(cls: type[Component]) -> type[Component] | None:
    """The abstract class whose inputs the component shares with all that can stand in its place."""
    bases = [base for base in cls.__mro__[1:] if inspect.isclass(base) and issubclass(base, Component)]
    ports = [base for base in bases if _is_port(base)]
    return ports[-1] if ports else None


def _is_port(base: type[Component]) -> bool:
    return base.__name__ not in CATALOGUE and any(isinstance(own, Input) for own in vars(base).values())


def _swaps(cls: type[Component], catalogue: Mapping[str, type[Component]]) -> str:
    used = [name for name, scenario in scenarios().items() if cls.__name__ in _places(scenario).values()]
    names = ", ".join(f"`{name}`" for name in used)
    where = f"Scenarios that have it: {names}.\n\n" if used else "No shipped scenario has it.\n\n"
    face = port(cls)
    others = [other for other in catalogue.values() if face and issubclass(other, face) and other is not cls]
    if not others or face is None:
        return where + "Any component or FMU that has the inputs and outputs which a scenario connects."
    links = "\n".join(f"- [{other.__name__}]({other.__name__}.md): {summary(other)}" for other in others)
    return (
        f"{where}Its port is `{face.__name__}`. These have the same, and so may [a class of your own]"
        f"(../own_controller.md):\n\n{links}{_command(cls, others)}"
    )


def _command(cls: type[Component], others: list[type[Component]]) -> str:
    """The command that puts the component into a scenario in the place of one of the others, if there is one."""
    names = {other.__name__ for other in others}
    for name, scenario in scenarios().items():
        for place, model in _places(scenario).items():
            if model in names and _fits(cls(), scenario, place):
                return f"\n\n```text\norchestrate run {name} --swap {place}={cls.__name__}\n```"
    return ""


def _fits(component: Component, scenario: Mapping[str, Any], place: str) -> bool:
    """Whether the scenario feeds what the component must be fed in a place, and takes only what it has."""
    connections = scenario.get("connections", {})
    sources = [source["from"] if isinstance(source, dict) else source for source in connections.values()]
    name = re.compile(rf"{place}(?:\[[^\]]*\])?\.(\w+)")
    fed, taken = ({m[1] for m in map(name.match, ends) if m} for ends in (connections, sources))
    needed = {slot.name for slot in component.of(Input) if not slot.declaration.optional}
    entry, known = scenario["instances"][place], {slot.name for slot in component.of(Input)}
    built = entry.get("build", {}).keys() <= component.build_arguments.keys()
    begun = entry.get("start", {}).keys().isdisjoint(slot.name for slot in component.of(Output))  # those are computed
    shown = taken <= {slot.name for slot in component.output_slots}
    return built and begun and needed <= fed <= known and shown


def _places(scenario: Mapping[str, Any]) -> dict[str, str]:
    entries = scenario["instances"].items()
    return {name: entry["component"] for name, entry in entries if "component" in entry}


@functools.cache
def scenarios() -> dict[str, dict[str, Any]]:
    """Every shipped scenario as it is written."""
    paths = sorted(Path(models.__file__ or "").parent.glob("*.toml"))
    found = {path.stem: tomllib.loads(path.read_text(encoding="utf-8")) for path in paths}
    return {name: scenario for name, scenario in found.items() if "instances" in scenario}


# ---------------------------------------------------------------- tables


def _section(title: str, body: str) -> str:
    return f"## {title}\n\n{body}\n" if body else ""


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A table in Markdown, without the columns that have nothing to say."""
    columns = [column for column in zip(head, *rows, strict=True) if any(column[1:])]
    lines = [" | ".join(cell.replace("|", "\\|") for cell in row) for row in zip(*columns, strict=True)]
    return "\n".join(f"| {line} |" for line in (*lines[:1], " | ".join("---" for _ in columns), *lines[1:]) if lines)


def _inputs(component: Component) -> str:
    rows = [
        (
            *_what(slot),
            _start(component, slot),
            "yes" if slot.declaration.optional else "",
            _text(slot),
        )
        for slot in component.of(Input)
    ]
    return _table(("name", "unit", "shape", "start", "optional", "what it is"), rows)


def _outputs(component: Component) -> str:
    rows = [(*_what(slot), _direct(component, slot), _text(slot)) for slot in component.output_slots]
    return _table(("name", "unit", "shape", "follows at once", "what it is"), rows)


def _parameters(component: Component) -> str:
    rows = [
        (*_what(slot), _start(component, slot), _bounds(slot), "yes" if slot.declaration.tunable else "", _text(slot))
        for slot in component.of(Parameter)
    ]
    return _table(("name", "unit", "shape", "start", "bounds", "tunable", "what it is"), rows)


def _kept(component: Component) -> str:
    rows = [
        (*_what(slot), _start(component, slot), type(slot.declaration).__name__.lower(), _text(slot))
        for slot in component.of(State, Memory)
    ]
    return _table(("name", "unit", "shape", "start", "kind", "what it is"), rows)


def _build_arguments(component: Component) -> str:
    rows = [
        (f"`{name}`", f"`{_short(repr(component.build_arguments[name]))}`", declaration.description)
        for name, declaration in component.declarations.items()
        if isinstance(declaration, Size | Data)
    ]
    return _table(("name", "default", "what it is"), rows)


def _what(slot: Slot) -> tuple[str, str, str]:
    unit = slot.unit if slot.type is float else {bool: "boolean", int: "integer", str: "text"}[slot.type]
    return f"`{slot.name}`", unit if unit != "1" else "", "×".join(map(str, slot.shape))


def _start(component: Component, slot: Slot) -> str:
    value = getattr(component, slot.name)
    if isinstance(value, np.ndarray):
        cells = value.ravel().tolist()
        value = cells[0] if len(set(cells)) == 1 else cells
    return _short(f"{value:.6g}" if isinstance(value, float) else str(value))


def _short(text: str) -> str:
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} …"


def _bounds(slot: Slot) -> str:
    low, high = slot.declaration.minimum, slot.declaration.maximum
    if low is None and high is None:
        return ""
    if high is None:
        return f"≥ {low:g}"
    return f"≤ {high:g}" if low is None else f"{low:g} to {high:g}"


def _direct(component: Component, slot: Slot) -> str:
    try:
        found = feedthrough(component)
    except TracingError:
        return "not known"
    names = {name.partition("[")[0] for scalar in slot.scalars for name in found[scalar]}
    if len(names) > 1 and names == {slot.name for slot in component.of(Input)}:
        return "all inputs"
    return ", ".join(f"`{name}`" for name in component.slots if name in names)


def _text(slot: Slot) -> str:
    return slot.declaration.description


# ---------------------------------------------------------------- the figure


def draw(component: Component) -> tuple[str, str]:
    """The figure as SVG, to stand in a page, and its caption; the same bytes each time."""
    cls = type(component)
    experiment = EXPERIMENTS.get(cls.__name__)
    if experiment is None:
        return _svg(*_excited(component)), f"Its outputs when {EXCITATION}."
    built = cls(**experiment.get("build", {}), **experiment.get("values", {}))
    shown = [[built.slots[name] for name in panel] for panel in experiment["panels"]]
    if "across" in experiment:
        ((name, limits),) = experiment["across"].items()
        return _svg(_characteristic(built, experiment, name, limits), shown, built.slots[name]), experiment["caption"]
    return _svg(_over_time(built, experiment), shown), experiment["caption"]


def _over_time(built: Component, experiment: Mapping[str, Any]) -> dict[str, Any]:
    step = experiment.get("step", default_step(built))
    inputs = {name: _signal(given) for name, given in experiment.get("inputs", {}).items()}

    def given(time: float) -> dict[str, Any]:
        # A little further on, so that no rounding decides on which side of a jump a point in time lies.
        return {name: _typed(built.slots[name], f(time + 1e-6 * step)) for name, f in inputs.items()}

    result = simulate(built, experiment["stop"], step, given)
    return result | {name: np.array([given(t)[name] for t in result["time"].tolist()]) for name in inputs}


def _characteristic(built: Component, experiment: Mapping[str, Any], name: str, limits: list[float]) -> dict[str, Any]:
    points = np.linspace(*limits, _POINTS)
    wanted = [output for panel in experiment["panels"] for output in panel]
    given = experiment.get("values", {}) | experiment.get("inputs", {})
    rows = []
    for x in points.tolist():
        simulation = Simulation(type(built)(**built.build_arguments, **given, **{name: x}))
        simulation.initialize()
        rows.append([simulation.get(output) for output in wanted])
    return {name: points} | {output: np.array([row[k] for row in rows]) for k, output in enumerate(wanted)}


def _signal(given: Any) -> Callable[[float], Any]:
    """A signal of `experiments.toml`: a constant, breakpoints ``[[t, value], ...]``, or one of these for each element.

    Between breakpoints the line is straight; two at one time are a jump.
    """
    if not isinstance(given, list):
        return lambda _: given
    if all(isinstance(x, list) and not any(isinstance(y, list) for y in x) for x in given):
        times, values = np.array(given, dtype=float).T
        return lambda time: float(np.interp(time, times, values))
    elements = [_signal(x) for x in given]
    return lambda time: [element(time) for element in elements]


def _typed(slot: Slot, value: Any) -> Any:
    return slot.type(round(value)) if slot.type in (int, bool) else value


def _excited(component: Component) -> tuple[dict[str, Any], list[list[Slot]]]:
    """What the reference signals say, a panel for each unit, the first four of them."""
    table = reference_signals(component)[f"{type(component).__name__}_ref.csv"]
    names = [name.strip('"') for name in table.partition("\n")[0].replace('","', '"\n"').split("\n")]
    columns = np.loadtxt(io.StringIO(table.partition("\n")[2]), delimiter=",", ndmin=2).T
    assert columns.shape == (len(names), STEPS + 1)
    signals = dict(zip(names, columns, strict=True))
    result: dict[str, Any] = {"time": signals["time"]}
    panels: dict[str, list[Slot]] = {}
    for slot in component.output_slots:
        if slot.type is float:
            panels.setdefault(slot.unit, []).append(slot)
            stack = np.stack([signals[name] for name in slot.scalars], axis=1)
            result[slot.name] = stack if slot.shape else stack[:, 0]
    return result, list(panels.values())[:4]


def _svg(result: Mapping[str, Any], panels: list[list[Slot]], across: Slot | None = None) -> str:
    import matplotlib as mpl
    from matplotlib.figure import Figure

    x = result[across.name if across else "time"]
    label = f"{across.name} in {across.unit}" if across else "time in s"
    style = {"svg.hashsalt": "railcosim", "svg.fonttype": "none", "font.size": 10, "axes.formatter.limits": (-4, 6)}
    ink = dict.fromkeys(("axes.edgecolor", "text.color", "axes.labelcolor", "xtick.color", "ytick.color"), "#010203")
    with mpl.rc_context(style | ink | {"axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(7.6, 0.5 + 1.9 * len(panels)), layout="constrained")
        all_axes = figure.subplots(len(panels), sharex=True, squeeze=False)[:, 0]
        for axes, panel in zip(all_axes, panels, strict=True):
            _draw_panel(axes, x, result, panel)
        all_axes[-1].set_xlabel(label)
        out = io.StringIO()
        figure.savefig(out, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    return text[text.index("<svg") :].replace("#010203", "currentColor").replace("\n", " ")


def _draw_panel(axes: Any, x: Any, result: Mapping[str, Any], panel: list[Slot]) -> None:
    colours = iter(_COLOURS * 9)
    steps = {"drawstyle": "steps-post"} if all(slot.type is not float for slot in panel) else {}
    for slot in panel:
        columns = np.asarray(result[slot.name], dtype=float).reshape(len(x), -1)
        for name, values in zip(slot.scalars, columns.T, strict=True):
            axes.plot(x, values, color=next(colours), label=name, linewidth=1.4, **steps)
    unit = panel[0].unit
    axes.set_ylabel("" if unit == "1" else unit)
    axes.grid(alpha=0.25)
    axes.legend(frameon=False, fontsize=9, loc="center left", bbox_to_anchor=(1.0, 0.5))
