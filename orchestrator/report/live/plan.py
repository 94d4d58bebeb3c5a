"""What the master of a run would do, written down for the master in ``resources/master.js``.

Which order, which connections by place, which start values: all of it is taken from the master that would run, so that
nothing is decided twice.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...fmi import Channel
from ...fmi.binding import FmuChannel, FmuSlave
from ...master import ALGORITHMS, Explicit, Master, find_loops
from ...problems import Problem
from ...run import Checked
from ...system import System
from ...times import count_steps
from ...wiring import described


def refusals(system: System, checked: Checked) -> list[Problem]:
    """What a page cannot do of what a system asks for."""
    stepping, algorithm = system.stepping, ALGORITHMS[system.stepping.algorithm]
    able = ", ".join(name for name, each in ALGORITHMS.items() if issubclass(each, Explicit))
    what = {
        f"algorithm = {stepping.algorithm}": (not issubclass(algorithm, Explicit), f"it does {able}"),
        f"extrapolation = {stepping.extrapolation}": (bool(stepping.extrapolation), "it holds inputs over a step"),
        "refresh": (stepping.refresh, "it reads outputs after a step alone"),
        "[[events]]": (bool(system.events), "it has no events"),
    }
    problems = [
        Problem("", f"{name} cannot be done by a live page", remedy) for name, (asked, remedy) in what.items() if asked
    ]
    interfaces = {name: model.interface for name, model in checked.models.items()}
    for loop in find_loops(interfaces, checked.wiring.links, doubtful=True):
        problems.append(Problem(loop[0], "it is part of an algebraic loop, which a live page does not solve"))
    for name, interface in interfaces.items():
        if interface.version != "2.0":
            version = f"{interface.model} is FMI {interface.version}"
            problems.append(Problem(name, f"{version}, and a live page steps FMI 2.0 alone"))
        problems += [
            Problem(f"{name}.{v.name}", "it is a text, which a live page does not read")
            for v in interface.of("output")
            if v.type == "String"
        ]
        problems += [
            Problem(f"{name}.{variable}", "it is set to a text, which a live page does not do")
            for variable in checked.wiring.starts[name]
            if interface.variables[variable].type == "String"
        ]
    for link in checked.wiring.links:
        if interfaces[link.source[0]].variables[link.source[1]].type == "String":
            problems.append(Problem(described(link.connection), "it hands a text on, which a live page does not"))
        if link.mapping is not None:
            problems.append(Problem(described(link.connection), "it maps values, which a live page does not"))
    return list(dict.fromkeys(problems))


def plan_of(checked: Checked, master: Master) -> dict[str, Any]:
    """The plan: times, instances, what is read, set and stepped, all by place.

    Args:
        checked: a system without `refusals`.
        master: of its instances, which are FMI 2.0 FMUs of this process.
    """
    stepping, exchange, algorithm = checked.system.stepping, master.exchange, master.algorithm
    assert isinstance(algorithm, Explicit)
    steps = count_steps(stepping.start_time, stepping.stop_time, stepping.step)
    assert steps is not None  # it was checked
    slaves: dict[str, FmuSlave] = {n: slave for n, slave in master.slaves.items() if isinstance(slave, FmuSlave)}
    places = {name: place for place, name in enumerate(slaves)}
    rates = master.coupling.settings.rates
    return {
        "start": stepping.start_time,
        "stop": stepping.stop_time,
        "step": stepping.step,
        "steps": steps,
        "every": max(1, round((stepping.record or stepping.step) / stepping.step)),
        "signals": exchange.signals,
        "depth": exchange.depth,
        "instances": [
            {
                "name": name,
                "starts": list(_starts(slave, checked.wiring.starts[name])),
                "feeds": [
                    _channel(feed.channel, 0)
                    | {
                        "sources": feed.sources,
                        "plain": feed.plain,
                        "scales": feed.scales,
                        "offsets": feed.offsets,
                        "thresholds": feed.thresholds,
                        "ages": feed.ages,
                    }
                    for feed in exchange.feeds[name]
                ],
                "yields": [
                    _channel(part.channel, 1) | {"begin": part.begin, "direct": part.direct}
                    for part in exchange.yields[name]
                ],
            }
            for name, slave in slaves.items()
        ],
        "sweep": [places[slave.name] for slave in master.coupling.sequence],
        "operations": [
            [int(operation), places[name], rates.get(name, 1)]
            for batch in algorithm.batches()
            for operation in batch.operations
            for name in batch.names
        ],
    }


def _channel(channel: Channel, way: int) -> dict[str, Any]:
    """Of which type some variables are, as the names of functions have it, and their value references."""
    assert isinstance(channel, FmuChannel)
    return {"kind": channel.calls[way][len("fmi2Set") :], "references": list(channel.references)}


def _starts(slave: FmuSlave, given: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Start values, those of one type together."""
    variables = slave.interface.variables
    for kind in dict.fromkeys(variables[name].type for name in given):
        names = [name for name in given if variables[name].type == kind]
        yield _channel(slave.channel(kind, names), 0) | {"values": told([given[name] for name in names])}


def told(values: Sequence[Any]) -> list[Any]:
    """Numbers as JSON can say them, and JavaScript reads them."""
    return [
        float(value) if math.isfinite(value) else repr(float(value)).replace("inf", "Infinity").replace("nan", "NaN")
        for value in values
    ]
