"""A step of single FMUs once more, shown the inputs that they were shown at the end of another step.

An output that passes an input on at once shows the input. Two ways through a step end with different inputs, and so
such an output differs between them however short the step is. Which outputs do so, a list of dependencies says; lists
name dependencies that there are none, though, and then a state would go unwatched. So the step is repeated with the
inputs of the other way: what still differs is the FMU's states.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ...errors import CouplingError
from ...fmi import Interface, Slave
from ...times import digits
from ..coupling import Coupling
from ..exchange import Feed
from ..extrapolation import Points
from .refusals import listed

_LAST = 1.0 / 16.0
"""Part of a step by which an FMU gets on so that it shows other inputs."""
_ROUNDING = 1e-12


class Repetition:
    """Repeats steps of those FMUs of which some output may pass a connected input on at once.

    Args:
        coupling: the instances and what they exchange.
        watched: (instance, variable) of the outputs whose error counts.

    Attributes:
        places: of the watched values that may show inputs. names: of the instances that they are of.
        is_proven: whether some watched value is known to show more than that, or what it passes on is brought up to
            date at each point anyway.
        reached: all values at the end of the step whose inputs were noted last, before anything is brought up to date.
    """

    def __init__(self, coupling: Coupling, watched: Iterable[tuple[str, str]]) -> None:
        self._coupling, self._exchange = coupling, coupling.exchange
        fed = {name: {t for feed in feeds for t in feed.targets} for name, feeds in self._exchange.feeds.items()}
        plain = set()
        self.places: dict[int, None] = {}
        self._slaves: dict[str, Slave] = {}
        for instance, name in watched:
            if _may_show(coupling.interfaces[instance], name, fed[instance]):
                self.places[self._exchange.places[instance, name]] = None
                self._slaves[instance] = coupling.slaves[instance]
            elif fed[instance]:
                plain.add(instance)
        stepping = coupling.settings.stepping
        self.is_proven = bool(plain) or not self.places or stepping.refresh
        self.is_proven |= stepping.algebraic_loops == "solve"
        self.reached: list[Any] = []
        self.names = tuple(self._slaves)
        self._shown: dict[str, list[tuple[Feed, list[Any], list[Points] | None]]] = {}
        self._has_moved = False

    def note(self, name: str, time: float) -> None:
        """Note the inputs that an instance has just been given for a step from a time in s."""
        if name not in self._slaves:
            return
        extrapolator, before = self._coupling.extrapolator, self._shown.get(name)
        shown: list[tuple[Feed, list[Any], list[Points] | None]] = []
        for feed in self._exchange.feeds[name]:
            past = None if extrapolator is None else extrapolator.continued(name, feed)
            shown.append((feed, self._exchange.inputs(feed, time), None if past is None else list(past)))
        if before is not None and [x[1] for x in before] != [x[1] for x in shown]:
            self._has_moved = True
        self._shown[name] = shown

    def _show(self, name: str, time: float) -> None:
        """Give an instance the inputs noted last, from a time in s on."""
        for feed, values, past in self._shown[name]:
            if past is None or self._coupling.extrapolator is None:
                feed.channel.set(values)
            else:
                self._coupling.extrapolator.give_again(name, values, past, time)

    def repeat(self, time: float, length: float, *, ended: bool = False) -> None:
        """Step with the inputs noted last, from saved states that have been restored, and read.

        Args:
            time: where the step begins, in s.
            length: of the step, in s.
            ended: whether the present values are those of its end, and act until shortly before it.
        """
        for name, slave in self._slaves.items():
            begin, rest = time, length
            if ended:
                self._coupling.write(name, time, length, ended=True)
                slave.step(time, length - _LAST * length, final=False)
                begin, rest = time + (length - _LAST * length), _LAST * length
            self._show(name, begin)
            slave.step(begin, rest, final=False)
        for slave in self._slaves.values():
            self._exchange.read_finite(slave, time + length)

    def prove(self, time: float, length: float) -> None:
        """Find out whether any watched value is more than the inputs shown, as soon as inputs move.

        Args:
            time: where a step began, to which the FMUs are back, in s.
            length: of the step, in s.

        Raises:
            CouplingError: none is, so that nothing can be watched.
        """
        for name, slave in self._slaves.items():
            self._show(name, time)
            slave.step(time, _LAST * length, final=False)
            self._exchange.read_finite(slave, time + length)
        pairs = [(self._exchange.values[k], self.reached[k]) for k in self.places]
        self.is_proven = any(abs(a - b) > _ROUNDING * max(abs(a), abs(b)) for a, b in pairs)
        if self._has_moved and not self.is_proven:
            names = listed([self._exchange.signals[k] for k in self.places])
            raise CouplingError(
                f"t = {digits(time)} s: adaptive has nothing to watch: {names} show the inputs of "
                f"their FMUs and no state, "
                "so that nothing tells a step that is too long; make a state an output, or choose gauss-seidel"
            )


def _may_show(interface: Interface, name: str, fed: set[str]) -> bool:
    """Whether an output may pass a connected input on at once."""
    depends = interface.variables[name].dependencies
    return bool(fed if depends is None else fed & depends)
