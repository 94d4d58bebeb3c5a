"""Train-to-train radio: what one train hears of another, and how old it is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..component import Component, Values
from ..declarations import Data, Input, Memory, Noise, Output, Parameter, Size
from ..maths import floor, logical_and, logical_not, logical_or, where
from ..tables import Column, Table

_ROUNDING = 1e-6
"""Of a refresh period, and s: what is due at a communication point belongs to it, whatever the rounding."""
_NEVER = 1e300
"""s: when a lost message arrives."""


OUTAGES = Table("outage", [Column("begin", "s"), Column("end", "s", after="begin")], by_place=True, may_be_empty=True)


class RadioLink(Component):
    """A one-way radio link that repeats a train's position and speed, and further numbers, late and not always.

    A message leaves every ``refresh`` seconds and is on its way for ``delay`` plus a uniform share of ``jitter``. It is
    lost with probability ``loss`` while the channel is good, ``burst_loss`` while it is bad; before each message the
    channel goes bad with probability ``burst_begin`` and good with ``burst_end`` (Gilbert 1960, Elliott 1963), so that
    bursts last 1 / burst_end messages on average and the channel is bad for burst_begin / (burst_begin + burst_end) of
    the time. ``interference`` loses as large a share of the others. Messages that leave during an outage (begin
    included, end not), or while ``sending`` is false, are lost as well. A message overtaken by a newer one is dropped.
    What was true at the start is known at the start.

    Without delay, jitter and losses, and refreshed at every step, the link is a wire. ``overrun`` says that more
    messages were under way than ``messages``, so that one was forgotten before it arrived.
    """

    source = "burst losses: Gilbert 1960, Elliott 1963; the rest is ours"
    equations = (
        r"Of the messages that have arrived, $t_k + \mathrm{delay} + \mathrm{jitter}\; u_k \leq t$, the one sent last"
        r" is heard; $\mathrm{age} = t - t_k$.",
        r"Losses: probability loss in the good state, burst_loss in the bad one; good $\rightarrow$ bad with"
        r" burst_begin, bad $\rightarrow$ good with burst_end, once a message. With interference $q$, $p + q\,(1 - p)$"
        r" takes the place of either probability $p$.",
    )

    messages = Size(16, description="how many messages can be under way")
    values = Size(0, minimum=0, description="how many further numbers a message carries, such as those of a plan")
    unit = Data("1", description="unit of the further numbers")
    outages = Data([], convert=OUTAGES.read, description=f"{OUTAGES.description}: then every message is lost")

    sent_position = Input("m", description="position the sender reports")
    sent_speed = Input("m/s", description="speed the sender reports")
    sent_values = Input(unit, 0.0, shape=(values,), optional=True, description="further numbers the sender reports")
    sending = Input("1", True, optional=True, description="whether the sender transmits")
    interference = Input("1", 0.0, optional=True, description="further probability of a loss, in either state")

    refresh = Parameter("s", 0.1, minimum=1e-6, description="period of the messages; longer than a step, or one a step")
    offset = Parameter("s", 0.0, minimum=0.0, description="time of the first message")
    delay = Parameter("s", 0.0, tunable=True, minimum=0.0, description="shortest time a message is under way")
    jitter = Parameter(
        "s", 0.0, tunable=True, minimum=0.0, description="further time under way, uniform from 0 to this"
    )
    loss = Parameter(
        "1", 0.0, tunable=True, minimum=0.0, maximum=1.0, description="probability of losing a message, channel good"
    )
    burst_begin = Parameter(
        "1", 0.0, tunable=True, minimum=0.0, maximum=1.0, description="probability of going bad, per message"
    )
    burst_end = Parameter(
        "1", 0.5, tunable=True, minimum=0.0, maximum=1.0, description="probability of becoming good, per message"
    )
    burst_loss = Parameter(
        "1", 1.0, tunable=True, minimum=0.0, maximum=1.0, description="probability of a loss, channel bad"
    )

    outage_begin = Parameter("s", 0.0, description="begin of one more outage, to vary without building anew")
    outage_end = Parameter("s", 0.0, description="end of it; not after its begin: none")

    luck = Noise(refresh, "uniform", description="whether a message is lost")
    weather = Noise(refresh, "uniform", description="whether the channel changes")
    haste = Noise(refresh, "uniform", description="how much of the jitter a message takes")

    number = Memory("1", -1.0, description="number of the last message sent")
    bad = Memory("1", False, output=True, description="whether the channel is in its bad state")
    overrun = Memory("1", False, output=True, description="whether a message was forgotten under way")
    last_position = Memory("m", 0.0, description="position in the message heard last")
    last_speed = Memory("m/s", 0.0, description="speed in the message heard last")
    last_values = Memory(unit, 0.0, shape=(values,), description="further numbers in the message heard last")
    last_time = Memory("s", 0.0, description="when the message heard last was sent")
    arrivals = Memory("s", _NEVER, shape=(messages,), description="arrival times of the last messages, newest first")
    times = Memory("s", 0.0, shape=(messages,), description="when they were sent")
    positions = Memory("m", 0.0, shape=(messages,), description="positions in them")
    speeds = Memory("m/s", 0.0, shape=(messages,), description="speeds in them")
    numbers = Memory(unit, 0.0, shape=(messages, values), description="further numbers in them")

    position = Output("m", description="position received last")
    speed = Output("m/s", description="speed received last")
    heard_values = Output(unit, shape=(values,), description="further numbers received last")
    age = Output("s", description="age of what was received last")

    def initial(self) -> Values:
        start = {"last_position": self.sent_position, "last_speed": self.sent_speed, "last_time": self.time}
        return start | {"last_values": self.sent_values}

    def outputs(self) -> Values:
        sent, position, speed, *values = self._heard()
        return {"position": position, "speed": speed, "heard_values": values, "age": self.time - sent}

    def update(self) -> Values:
        due = self._due()
        rows = {"arrivals": self._arrival(), "times": self.time, "positions": self.sent_position}
        rows["speeds"] = self.sent_speed
        oldest = self.arrivals[-1]
        forgotten = logical_and(oldest > self.time + _ROUNDING, oldest < _NEVER)
        sent, position, speed, *values = self._heard()
        numbers = [
            self._shifted(column, newest, due) for column, newest in zip(self.numbers.T, self.sent_values, strict=True)
        ]
        return {
            "number": where(due, self._count(), self.number),
            "bad": where(due, self._turns_bad(), self.bad),
            "overrun": logical_or(self.overrun, logical_and(due, forgotten)),
            "last_time": sent,
            "last_position": position,
            "last_speed": speed,
            "last_values": values,
            "numbers": [list(row) for row in zip(*numbers, strict=True)] if numbers else self.numbers,
            **{name: self._shifted(getattr(self, name), newest, due) for name, newest in rows.items()},
        }

    def _count(self) -> Any:
        return floor((self.time - self.offset) / self.refresh + _ROUNDING)

    def _due(self) -> Any:
        return self._count() > self.number

    def _turns_bad(self) -> Any:
        """The channel's state for the message that is due."""
        return where(self.bad, logical_not(self.weather < self.burst_end), self.weather < self.burst_begin)

    def _arrival(self) -> Any:
        """When the message that is due arrives."""
        loss = where(self._turns_bad(), self.burst_loss, self.loss)
        lost = self.luck < loss + self.interference * (1.0 - loss)
        silent = logical_not(self.sending)
        now = self.time + _ROUNDING
        for begin, end in [*self.outages, (self.outage_begin, self.outage_end)]:
            silent = logical_or(silent, logical_and(now >= begin, now < end))
        return where(logical_or(lost, silent), _NEVER, self.time + self.delay + self.jitter * self.haste)

    def _heard(self) -> list[Any]:
        """Time of sending, position, speed and further numbers of the newest message that has arrived."""
        now = self.time + _ROUNDING
        heard = [self.last_time, self.last_position, self.last_speed, *self.last_values]
        columns = zip(self.arrivals, self.times, self.positions, self.speeds, self.numbers, strict=True)
        for arrival, time, position, speed, numbers in reversed(list(columns)):
            heard = _choose(arrival <= now, [time, position, speed, *numbers], heard)
        arrived = logical_and(self._due(), self._arrival() <= now)
        return _choose(arrived, [self.time, self.sent_position, self.sent_speed, *self.sent_values], heard)

    def _shifted(self, column: Any, newest: Any, due: Any) -> list[Any]:
        """A column with a message put in at its head where one is due."""
        moved = [newest, *column[:-1]]
        return [where(due, new, old) for new, old in zip(moved, column, strict=True)]


def _choose(condition: Any, then: Sequence[Any], otherwise: Sequence[Any]) -> list[Any]:
    return [where(condition, a, b) for a, b in zip(then, otherwise, strict=True)]
