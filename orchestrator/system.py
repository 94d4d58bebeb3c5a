"""`System`: instances of FMUs, connections and start values, the one in-memory description of what is simulated."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal, TypeVar

from ..components.errors import did_you_mean

Loops = Literal["delay", "solve"]
LOOPS: tuple[Loops, ...] = ("delay", "solve")
Unsettled = Literal["stop", "go-on"]
UNSETTLED: tuple[Unsettled, ...] = ("stop", "go-on")
Acceleration = Literal["none", "aitken", "anderson"]
ACCELERATIONS: tuple[Acceleration, ...] = ("none", "aitken", "anderson")
Together = Literal["together"]
TOGETHER: Together = "together"
ACTIONS = ("set", "override", "freeze", "bias", "ramp", "connect")


@dataclass
class Instance:
    """One FMU in the system.

    Attributes:
        name: ``"gust"``, or ``"train[2]"`` where the scenario gives a count.
        model: a catalogue name, ``"path/to/any.fmu"``, or ``"my_file.py:MyClass"``.
        build: build arguments by name.
        start: parameters and start values by variable name (``"alpha"``, ``"force"`` for an array, ``"force[2]"``).
            Text is an expression of ``i`` and ``count`` unless the variable is a string.
        index: 1-based place among its siblings; None where there is no count.
        count: how many siblings, itself included.
        step: communication step of its own in s, a whole multiple of the system's; None for the system's.
        isolate: whether it runs in a process of its own, or ``"together"`` with others of the same FMU that do so.
        step_timeout: wall time in s after which a call of an isolated instance counts as hanging.
        memory_limit: what an isolated instance may use, in MiB.
        swapped: whether another model stands here than the scenario wrote; start values it lacks are then dropped.
        origin: where it was written, for messages.
    """

    name: str
    model: str
    build: dict[str, Any] = field(default_factory=dict)
    start: dict[str, Any] = field(default_factory=dict)
    index: int | None = None
    count: int = 1
    step: float | None = None
    isolate: bool | Together = False
    step_timeout: float | None = None
    memory_limit: float | None = None
    swapped: bool = False
    origin: str = field(default="", compare=False)


@dataclass
class Connection:
    """``target`` (an input) follows ``source`` (an output): ``scale * value + offset``, after converting units.

    Attributes:
        source: ``"cruise[1].force"``; a whole array by its bare name.
        target: ``"train[1].force"``.
        delay: how many communication points older the value is than it would be without.
        threshold: by what the value is made one that is no Real: a Boolean is true above it, a whole number rounded up
            above this fraction.
        scale: 1 where it is not given; one that is given also says that units which do not convert are taken care of.
        optional: whether it stands for nothing where one of its ends has no such variable: an element that a pattern
            may or may not mean.
        convert: whether units are converted where the two ends say what they are.
        map: what becomes of single values that are no Reals, by the value as text: ``{"1": 10}``, ``{"true": False}``,
            items of enumerations by name. Others stay.
        origin: where it was written, for messages.
    """

    source: str
    target: str
    delay: int = 0
    scale: float | None = None
    offset: float = 0.0
    optional: bool = False
    threshold: float | None = None
    convert: bool = True
    map: dict[str, bool | int | str] | None = None
    origin: str = field(default="", compare=False)


@dataclass
class Event:
    """Something that happens to a signal at a time: a new value, or a fault.

    Attributes:
        signal: ``"sensor.speed"`` (an output: changed for all who receive it, and recorded so) or
            ``"cruise[2].ahead_speed"`` (an input: changed for this one alone). ``"set"`` takes an unconnected input or
            a tunable parameter, ``"connect"`` a connected input.
        action: ``"set"`` (a new value from now on), ``"override"`` (another value while it lasts), ``"freeze"`` (the
            value of the beginning), ``"bias"`` (an added value), ``"ramp"`` (an added value that grows) or
            ``"connect"`` (another output that the input follows while it lasts).
        number: which entry of the scenario it belongs to, from 1; 0 where it is its place in the system that counts.
        at: when it begins, s. duration: how long it lasts, s; None for ever. every: period of repetition, s.
        value: of set, override and bias, in the signal's unit. rate: of a ramp, in the signal's unit per second.
        source: of connect: what the input follows; the signal is its target. fade: for how long, in s, the difference
            to what passed before fades away, so that nothing jumps.
        origin: where it was written, for messages.
    """

    signal: str
    action: str
    at: float
    value: Any = None
    rate: float | None = None
    duration: float | None = None
    every: float | None = None
    source: Connection | None = None
    fade: float | None = None
    number: int = field(default=0, compare=False)
    origin: str = field(default="", compare=False)


@dataclass
class Stepping:
    """How a system is stepped.

    Attributes:
        stop_time: end in s.
        step: communication step in s.
        start_time: begin in s.
        record: distance of recorded points in s; None records every step.
        record_only: patterns of the signals that are recorded, such as ``train*.speed``; empty for all. As a table
            with the distance of values in s, a multiple of ``record``: the first that means a signal counts.
        algorithm: the master's, by name.
        order: instance names in the order they step; empty derives it from direct feed-through.
        extrapolation: order of the polynomial by which inputs are continued over a step (0: held), for FMUs that can
            interpolate their inputs.
        algebraic_loops: ``"delay"`` (a loop acts one step late) or ``"solve"`` (solved at each communication point).
        refresh: whether outputs with direct feed-through are brought up to date at each communication point.
        tolerance: relative; of ``iterative`` for what is exchanged, of ``adaptive`` for the error of a step; None for
            the algorithm's default. tolerances: ``[relative, absolute]`` of single signals, by name.
        max_iterations, relaxation, acceleration: of ``iterative``. unsettled: whether it stops (``"stop"``) where they
            lead nowhere, or goes on with the last iterate (``"go-on"``). min_step: of ``adaptive``, s.
    """

    stop_time: float = 1.0
    step: float = 0.1
    start_time: float = 0.0
    record: float | None = None
    record_only: list[str] | dict[str, float] = field(default_factory=list)
    algorithm: str = "gauss-seidel"
    order: list[str] = field(default_factory=list)
    extrapolation: int = 0
    algebraic_loops: Loops = "delay"
    refresh: bool = False
    tolerance: float | None = None
    tolerances: dict[str, list[float]] = field(default_factory=dict)
    max_iterations: int = 50
    relaxation: float = 1.0
    acceleration: Acceleration = "anderson"
    unsettled: Unsettled = "stop"
    min_step: float | None = None


@dataclass
class Judged:
    """What is made of what is recorded: requirements and metrics by name, known values and figures as tables."""

    requirements: dict[str, str] = field(default_factory=dict)
    metrics: dict[str, str] = field(default_factory=dict)
    published: list[dict[str, Any]] = field(default_factory=list)
    references: list[dict[str, Any]] = field(default_factory=list)
    figures: list[dict[str, Any]] = field(default_factory=list)


@dataclass
class Provenance:
    """Where a system came from.

    Attributes:
        name, path: of the scenario file. text: the scenario as read, for the record of the run.
        named: the models that options put in place of the scenario's.
        title, source: what it says of itself. description: the same, of the preset in force.
        preset: the preset in force (``default_preset`` for the file as it stands); None where that has no name.
        presets: every name a preset may be asked for by. preset_descriptions: what they say of themselves, by name.
        default_preset: the one that means the file as it stands.
        modified: whether anything was changed beyond file and preset, so that known values are not judged.
        command: the words after ``orchestrate run`` that give this system; empty where no options do: Python made it.
        rescaled_from: the step in s before `--step` changed it: every sample time equal to it follows the step.
        notes: what a user should know of how it was read, and of what options have decided.
        origins: where things were written, for messages: by ``"train[1]"``, ``"train[1].speed"`` (a start value),
            ``"instances.train[1].step"`` (an option of an instance), ``"instances.train[1].build.carriages"`` (a build
            argument that a preset or an option gave), ``"simulation.step"``,
            ``"simulation.tolerances.train[1].speed"``, ``"events[1]"``, ``"require.comfort"``, ``"metrics.settling"``,
            ``"published[1]"``, ``"references[1]"``, ``"figures[1]"``, ``"study"``, ``"study.runs"``,
            ``"study.vary.cruise.alpha"``.
    """

    title: str = ""
    source: str = ""
    description: str = ""
    preset: str | None = None
    presets: tuple[str, ...] = field(default=(), compare=False)
    preset_descriptions: dict[str, str] = field(default_factory=dict, compare=False, repr=False)
    default_preset: str | None = field(default=None, compare=False)
    modified: bool = field(default=False, compare=False)
    command: tuple[str, ...] = field(default=(), compare=False)
    rescaled_from: float | None = field(default=None, compare=False)
    name: str = field(default="system", compare=False)
    path: str = field(default="", compare=False)
    text: str = field(default="", compare=False, repr=False)
    named: tuple[str, ...] = field(default=(), compare=False)
    notes: tuple[str, ...] = field(default=(), compare=False)
    origins: dict[str, str] = field(default_factory=dict, compare=False, repr=False)


@dataclass(init=False, slots=True)
class System:
    """What is simulated and how.

    Args:
        instances: by name.
        connections: between them.
        events: what happens on the way.
        seed: of all noise.
        study: what `[study]` says: `runs`, `seed`, `design`, and `vary` by key.
        stepping: how it is stepped.
        judged: what is made of the results.
        provenance: where it came from.
        **values: fields of `Stepping`, `Judged` and `Provenance` by their names, in place of those given:
            ``System(step=0.1, stop_time=60.0, metrics={"peak": "max(train.speed)"})``.

    Attributes:
        instances, connections, events, seed, study, stepping, judged, provenance: as above.

    Raises:
        TypeError: there is no such field.
    """

    instances: dict[str, Instance]
    connections: list[Connection]
    events: list[Event]
    seed: int
    study: dict[str, Any]
    stepping: Stepping
    judged: Judged
    provenance: Provenance

    def __init__(
        self,
        *,
        instances: dict[str, Instance] | None = None,
        connections: list[Connection] | None = None,
        events: list[Event] | None = None,
        seed: int = 0,
        study: dict[str, Any] | None = None,
        stepping: Stepping | None = None,
        judged: Judged | None = None,
        provenance: Provenance | None = None,
        **values: Any,
    ) -> None:
        self.instances = {} if instances is None else instances
        self.connections = [] if connections is None else connections
        self.events = [] if events is None else events
        self.seed = seed
        self.study = {} if study is None else study
        self.stepping = _changed(stepping or Stepping(), values)
        self.judged = _changed(judged or Judged(), values)
        self.provenance = _changed(provenance or Provenance(), values)
        if values:
            valid = [one.name for part in (Stepping, Judged, Provenance) for one in fields(part)]
            name = next(iter(values))
            raise TypeError(f"a system has no {name!r}{did_you_mean(name, valid)}")

    def __repr__(self) -> str:
        name = " ".join(filter(None, (self.provenance.name, self.provenance.preset)))
        return (
            f"<System {name}: {len(self.instances)} instances, {len(self.connections)} connections, "
            f"{self.stepping.algorithm}, steps of {self.stepping.step:g} s up to {self.stepping.stop_time:g} s>"
        )

    def changed(self, **values: Any) -> System:
        """A copy with other values of its fields, or of those of its parts: ``system.changed(step=0.05, seed=7)``.

        No command is known that gives the copy, unless it is among the values.
        """
        return System(**{one.name: getattr(self, one.name) for one in fields(self)} | {"command": ()} | values)

    def add(self, name: str, model: str, build: dict[str, Any] | None = None, **start: Any) -> Instance:
        """Add one instance.

        Args:
            name: its name in connections and results.
            model: a catalogue name, a path ending in ``.fmu``, or ``"file.py:Class"``.
            build: build arguments.
            **start: parameters and start values by variable name.

        Raises:
            ValueError: the name is taken.
        """
        if name in self.instances:
            raise ValueError(f"the system already has an instance {name!r}")
        self.instances[name] = Instance(name, model, dict(build or {}), dict(start))
        self.provenance.command = ()
        return self.instances[name]

    def connect(
        self,
        source: str,
        target: str,
        delay: int = 0,
        scale: float | None = None,
        offset: float = 0.0,
        *,
        threshold: float | None = None,
    ) -> None:
        """Let an input follow an output; both are written ``"instance.variable"``."""
        self.connections.append(Connection(source, target, delay, scale, offset, threshold=threshold))
        self.provenance.command = ()


_Part = TypeVar("_Part", Stepping, Judged, Provenance)


def _changed(part: _Part, values: dict[str, Any]) -> _Part:
    """A copy of the part with those of the values that are its fields, which are taken out."""
    own = {one.name: values.pop(one.name) for one in fields(part) if one.name in values}
    return replace(part, **own)
