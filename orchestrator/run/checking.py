"""Everything that can be known to be wrong, or worth knowing, before a step is taken."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

from ..errors import ScenarioError
from ..evaluation import Judge, Names, check_values, split_metric
from ..figures import check_figures, remarked
from ..fmi import Interface, Kind, Model, Workspace, load_models
from ..isolation import check_isolation, check_once_per_process, isolation_notes
from ..master import ALGORITHMS, check_coupling, check_events, describe_coupling
from ..names import SignalName, matching
from ..problems import Problem, suggestion
from ..scenario import import_notes, untrusted_code
from ..system import System
from ..times import count_steps, digits
from ..wiring import Order, Wiring, derive_order, wire
from .loop_delay import loop_delays
from .recording import kept_signals
from .size import tell_size

_MOST_STEPS = 1e15
"""So many points in time are not told apart, let alone run through."""


@dataclass(frozen=True)
class Checked:
    """A system found fit to run.

    Attributes:
        system: as it will run: after a swap, without the tables that speak of what the new model does not have.
        models: by instance name. wiring: start values and scalar connections. order: how a sweep steps.
        notes: what a user should know though it is not an error.
        judge: what judges its runs.
        large: the one of the notes that says how large results will be, where they will be large.
    """

    system: System
    models: Mapping[str, Model]
    wiring: Wiring
    order: Order
    notes: tuple[str, ...]
    judge: Judge
    large: str = ""

    @cached_property
    def units(self) -> dict[str, str]:
        """Units by full name, of signals and parameters that have one."""
        sources = {link.source for link in self.wiring.every_link}
        return {
            f"{name}.{v.name}": v.unit
            for name, model in self.models.items()
            for v in model.interface.variables.values()
            if v.unit is not None and (v.causality in ("output", "parameter") or (name, v.name) in sources)
        }


def check(system: System, workspace: Workspace, kind: Kind = "auto", *, trusted: bool = True) -> Checked:
    """Check a system as a whole.

    Args:
        system: what is to run.
        workspace: where FMUs are unpacked.
        kind: how components become models.
        trusted: whether Python code that the scenario names is imported wherever it stands.

    Raises:
        ScenarioError: with every problem found, each naming its place and the remedy; with code that is not trusted
            alone, before any is imported.
    """
    if not trusted and (strange := untrusted_code(system)):
        raise ScenarioError(strange)
    problems = _check_simulation(system)
    if system.stepping.algorithm not in ALGORITHMS:  # nothing more can be said of it
        raise ScenarioError(problems)
    try:
        models = load_models(system, workspace, kind)
    except ScenarioError as error:
        raise ScenarioError([*problems, *error.problems]) from error
    interfaces = {name: model.interface for name, model in models.items()}
    wiring = wire(system, interfaces)
    problems += wiring.problems
    problems += check_isolation(system) + check_once_per_process(system, interfaces)
    names = signal_names(interfaces, wiring)
    steady = not ALGORITHMS[system.stepping.algorithm].varies_step
    every_step = steady and (
        system.stepping.record is None
        or abs(system.stepping.record - system.stepping.step) < 1e-9 * system.stepping.step
    )
    system, left_out = _without_the_missing(system, interfaces, names, steady, every_step)
    problems += check_events(system, interfaces, wiring)
    problems += check_coupling(system, interfaces, wiring)
    parameters = {f"{name}.{v.name}" for name, interface in interfaces.items() for v in interface.of("parameter")}
    parameters |= wiring.left.keys()
    judged = system.judged
    judge = Judge(judged.metrics, judged.requirements, names, parameters, steady=steady)
    problems += judge.requirement_problems + judge.metric_problems
    if not judge.metric_problems:
        problems += check_values(judged.published, judged.references, judge.indices, system.provenance.presets)
    recorded, told = _recorded(system, names)
    problems += told + check_figures(system.judged.figures, names, every_step)
    if problems:
        raise ScenarioError(problems)
    system, undrawn = _without_unrecorded(system, recorded, parameters.intersection(names), every_step)
    order = derive_order(list(system.instances), wiring.every_link, system.stepping.order)
    large = tell_size(system, sum(name not in parameters for name in recorded))
    notes = [*left_out, *undrawn, *([large] if large else []), *_notes(system, models, wiring, order)]
    return Checked(system, models, wiring, order, tuple(notes), judge, large)


def _recorded(system: System, names: Collection[str]) -> tuple[Collection[str], list[Problem]]:
    """The signals that are recorded, and what is wrong with the patterns that say so."""
    patterns = system.stepping.record_only
    problems = [
        Problem("simulation.record_only", f"no signal is called {pattern!r}", suggestion(pattern, names))
        for pattern in patterns
        if not matching(names, [pattern])
    ]
    return matching(names, patterns) if patterns else names, [*problems, *_apart(system)]


def _apart(system: System) -> Iterator[Problem]:
    """What is wrong with how often signals are recorded, where that is said for each."""
    patterns, rows = system.stepping.record_only, system.stepping.record or system.stepping.step
    for pattern, apart in patterns.items() if isinstance(patterns, dict) and 0.0 < rows < math.inf else ():
        if count_steps(0.0, apart, rows) is None:
            message = f"{digits(apart)} s of {pattern!r} is no whole number of rows, which are {digits(rows)} s apart"
            remedy = f"take a multiple of {digits(rows)} s, or a simulation.record that divides all"
            yield Problem("simulation.record_only", message, remedy)


def _without_unrecorded(
    system: System, recorded: Collection[str], parameters: Collection[str], every_step: bool
) -> tuple[System, list[str]]:
    """A system without the figures that need more than is recorded, and notes that name them."""
    figures, drawable = system.judged.figures, [*recorded, *parameters]
    if not system.stepping.record_only:
        return system, []
    rows = kept_signals([name for name in recorded if name not in parameters], system.stepping).get("apart", {})
    apart = {name for name, every in rows.items() if every > 1}
    unknown = [x for x in figures if check_figures([x], drawable, every_step)]
    sparse = [x for x in figures if x not in unknown and check_figures([x], drawable, every_step, apart)]
    notes = [
        f"not drawn, because {why} (record_only): {', '.join(repr(figure.get('title')) for figure in left)}"
        for why, left in (
            ("what they show is not recorded", unknown),
            ("they look at every row of what is recorded less often", sparse),
        )
        if left
    ]
    return system.changed(figures=[x for x in figures if x not in [*unknown, *sparse]]) if notes else system, notes


def _without_the_missing(
    system: System, interfaces: Mapping[str, Interface], names: list[str], steady: bool, every_step: bool
) -> tuple[System, list[str]]:
    """After a swap, a system without the tables that speak of variables the new model does not have, and what they are.

    A controller of one's own need not have every output that the scenario's own figures draw.
    """
    if not any(instance.swapped for instance in system.instances.values()):
        return system, []
    judge = Judge(system.judged.metrics, system.judged.requirements, names, steady=steady)
    requirements = {k: v for k, v in system.judged.requirements.items() if not judge.requirement_faults[k]}
    metrics = {k: v for k, v in system.judged.metrics.items() if not judge.metric_faults[k]}
    known = Names(names)
    figures = [figure for figure in system.judged.figures if not check_figures([figure], known, every_step)]
    published, references = (
        [entry for entry in entries if split_metric(str(entry.get("metric")))[0] in metrics]
        for entries in (system.judged.published, system.judged.references)
    )
    lost = {event.signal for event in system.events} | set(system.stepping.tolerances)
    lost -= {signal for signal in lost if _is_there(signal, interfaces)}
    gone = [f"requirement {name!r}" for name in system.judged.requirements if name not in requirements]
    gone += [f"metric {name!r}" for name in system.judged.metrics if name not in metrics]
    gone += [f"figure {figure.get('title')!r}" for figure in system.judged.figures if figure not in figures]
    gone += [f"event or tolerance of {signal!r}" for signal in sorted(lost)]
    notes = [f"left out, because the swapped model lacks what they speak of: {', '.join(gone)}"] if gone else []
    kept = system.changed(
        requirements=requirements,
        metrics=metrics,
        figures=remarked(figures, swaps(system, interfaces)),
        published=published,
        references=references,
        events=[event for event in system.events if event.signal not in lost],
        tolerances={signal: value for signal, value in system.stepping.tolerances.items() if signal not in lost},
    )
    return kept, notes


def swaps(system: System, interfaces: Mapping[str, Interface]) -> str:
    """Which models stand in the place of others: what the figures of a scenario hold then is not what it wrote."""
    found = {
        SignalName(instance.name).group: interfaces[instance.name].label
        for instance in system.instances.values()
        if instance.swapped
    }
    return ", ".join(f"{group}: {label}" for group, label in found.items())


def _is_there(signal: str, interfaces: Mapping[str, Interface]) -> bool:
    instance, name = SignalName.parse(signal)
    return instance in interfaces and interfaces[instance].scalars(name) is not None


def signal_names(interfaces: Mapping[str, Interface], wiring: Wiring) -> list[str]:
    """What expressions may speak of: everything that will be recorded, every parameter, and what a swap left."""
    sources = {link.source for link in wiring.every_link}
    return [
        *(
            f"{instance}.{variable.name}"
            for instance, interface in interfaces.items()
            for variable in interface.variables.values()
            if variable.causality in ("output", "parameter") or (instance, variable.name) in sources
        ),
        *wiring.left,
    ]


def _check_simulation(system: System) -> list[Problem]:
    problems = []
    if not system.instances:
        problems.append(Problem("", "the system has no instances"))
    if system.stepping.algorithm not in ALGORITHMS:
        near = suggestion(system.stepping.algorithm, ALGORITHMS)
        problems.append(Problem("", f"algorithm {system.stepping.algorithm!r} is unknown", near))
    problems += [Problem("", message) for message in _check_times(system)]
    if system.stepping.order:
        missing = [name for name in system.instances if name not in system.stepping.order]
        unknown = [name for name in system.stepping.order if name not in system.instances]
        twice = [name for name, times in Counter(system.stepping.order).items() if times > 1]
        for name in unknown:
            near = suggestion(name, system.instances)
            problems.append(Problem("order", f"there is no instance {name!r}", near, (SignalName(name),)))
        problems += [Problem("order", f"{name!r} is missing", names=(SignalName(name),)) for name in missing]
        problems += [Problem("order", f"{name!r} stands twice", names=(SignalName(name),)) for name in twice]
    return problems


def _check_times(system: System) -> list[str]:
    """What is wrong with step, end and rows, a sentence each."""
    if not 0.0 < system.stepping.step < math.inf:
        return [f"step must be a positive number, not {system.stepping.step!r} s"]
    if not 0.0 < system.stepping.stop_time - system.stepping.start_time < math.inf:
        return [f"stop_time {system.stepping.stop_time!r} s must lie after start_time {system.stepping.start_time!r} s"]
    if (
        system.stepping.algorithm in ALGORITHMS and ALGORITHMS[system.stepping.algorithm].varies_step
    ):  # which lands wherever it is told to
        wrong = system.stepping.record is not None and not 0.0 < system.stepping.record < math.inf
        return [f"record must be a positive number, not {system.stepping.record!r} s"] if wrong else []
    record = system.stepping.step if system.stepping.record is None else system.stepping.record
    duration = "stop_time - start_time" if system.stepping.start_time else "stop_time"
    problems = []
    start, stop = system.stepping.start_time, system.stepping.stop_time
    for name, begin, end in ((duration, start, stop), ("record", 0.0, record)):
        count = (end - begin) / system.stepping.step
        if count >= _MOST_STEPS:
            problems.append(
                f"{name} = {digits(end - begin, begin, end)} s is {count:.3g} steps of "
                f"{digits(system.stepping.step)} s: too many to count"
            )
        elif count_steps(begin, end, system.stepping.step) is None:
            problems.append(
                f"{name} = {digits(end - begin, begin, end)} s is not a whole multiple of step = "
                f"{digits(system.stepping.step)} s"
            )
    return problems


def describe_stepping(checked: Checked) -> list[str]:
    """How a run would step, a line each."""
    system = checked.system
    interfaces = {name: model.interface for name, model in checked.models.items()}
    algorithm = ALGORITHMS[system.stepping.algorithm]
    steps = [f"steps in the order: {', '.join(checked.order.sequence)}"] if algorithm.in_order else []
    lines = [f"{algorithm.name} {line}" for line in (*steps, *algorithm.fit(system, interfaces, checked.wiring).steps)]
    delays = loop_delays(system, interfaces, checked.wiring, checked.order.sequence)
    lines += [str(delay) for delay in delays if not delay.wanted and delay.steps]
    lines += _describe_routings(checked.wiring)
    for instance in system.instances.values():
        if instance.step is not None:
            lines.append(f"{instance.name} steps every {digits(instance.step)} s")
    return lines


def _describe_routings(wiring: Wiring) -> Iterator[str]:
    """Which inputs follow other outputs than before, from when on."""
    before = wiring
    for when, now in wiring.routings:
        followed = {link.target: link.source for link in before.links}
        others = [f"{x.target} follows {x.source}" for x in now.links if followed[x.target] != x.source]
        if others:
            yield f"{when}{', '.join(others)}"
        before = now


def _notes(system: System, models: Mapping[str, Model], wiring: Wiring, order: Order) -> list[str]:
    notes = dict.fromkeys(system.provenance.notes)
    notes |= dict.fromkeys([model.note for model in models.values() if model.note] + wiring.notes)
    notes.update(dict.fromkeys(import_notes(system)))
    interfaces = {name: model.interface for name, model in models.items()}
    for interface in {id(interface): interface for interface in interfaces.values()}.values():
        notes.update(dict.fromkeys(interface.remarks))
    for when, now in wiring.routings:
        delays = [x for x in loop_delays(system, interfaces, now, order.sequence) if x.wanted]
        notes |= {f"{when}{delay}": None for delay in delays if str(delay) not in notes}
    notes.update(dict.fromkeys(isolation_notes(system, models)))
    notes.update(dict.fromkeys(describe_coupling(system, interfaces, wiring)))
    if ALGORITHMS[system.stepping.algorithm].in_order:
        notes.update(dict.fromkeys(order.late))
    return list(notes)
