"""The numbers of an iteration: what is guessed, what that led to, and whether the two agree.

They stand in one array, which the compiled loop goes on with: ``native/loops.c`` finds them there in this order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from ...errors import CouplingError, FmuError, RunError, StoppedError
from ...system import Stepping
from ...times import digits
from ..exchange import Exchange
from .acceleration import ACCELERATIONS, Vector

HEAD = 8
"""Numbers before those of the values: the round, and how many were compared; of all steps how many rounds, the most in
one, and the largest error in units of the tolerance."""
_ROUND, _COMPARED, _ROUNDS, _MOST, _RESIDUAL = range(5)
_HOPELESS, _GROWN = 1e12, 10.0
"""How many times farther apart than at first values are that nothing will bring together, or that are getting away."""
_LAST, _LOOSE = 5, 0.01
"""Iterations whose distances tell how near they get, and the tolerance from which on none is advised."""
_SHOWN = 3


class Iteration:
    """Of one group of instances.

    Args:
        exchange: the values.
        passed: places of those that one of the group gives to another or itself: first those that have to be guessed.
        guessed: how many these are.
        tolerances: relative and absolute, of all values.
        stepping: how to iterate.

    Attributes:
        reals: places of the real numbers among what is passed on, the first ``guess_count`` of them guessed.
        others: places of the other values.
        numbers: all that is known of the present step, and what has been counted.
        unsettled: begins in s of the steps that were taken though nothing agreed.
    """

    def __init__(
        self,
        exchange: Exchange,
        passed: Sequence[int],
        guessed: int,
        tolerances: Sequence[tuple[float, float]],
        stepping: Stepping,
    ) -> None:
        self._exchange, self.stepping = exchange, stepping
        self.reals = [k for k in passed if exchange.kinds[k] == "Real"]
        self.others = [k for k in passed if exchange.kinds[k] != "Real"]
        self.guess_count = sum(exchange.kinds[k] == "Real" for k in passed[:guessed])
        self._relative_tolerances = {k: tolerances[k][0] for k in self.reals}
        bounds = np.array([tolerances[k] for k in self.reals], dtype=np.float64).reshape(-1, 2)
        n, m = len(self.reals), len(self.others)
        self._ends = np.cumsum([HEAD, *[n] * 6, m, m, stepping.max_iterations]).tolist()
        self.use(np.concatenate([np.zeros(HEAD), bounds[:, 0], bounds[:, 1], np.zeros(self._ends[-1] - self._ends[2])]))
        self._follow: Callable[[Vector, Vector], Vector]
        self.unsettled: list[float] = []

    def use(self, numbers: Vector) -> None:
        """Keep the numbers from now on in another array, which has what the present one has."""
        self.numbers = numbers
        self._head, *rest = np.split(numbers[: self._ends[-1]], self._ends[:-1])
        self._relative, self._absolute, self._guess, self._reached, self._scale, self._error = rest[:6]
        self._flags, self._differ, self._sizes = rest[6:]

    @property
    def round(self) -> int:
        """Number of the round that is under way, from 1."""
        return int(self._head[_ROUND])

    def begin(self) -> None:
        """Begin with a step."""
        self._head[[_ROUND, _COMPARED]] = 0.0
        self._follow = ACCELERATIONS[self.stepping.acceleration](self.stepping.relaxation)

    def begin_round(self) -> None:
        """Note what is guessed."""
        values = self._exchange.values
        self._head[_ROUND] += 1.0
        self._guess[:] = [values[k] for k in self.reals]
        self._before = [values[k] for k in self.others]

    @np.errstate(all="ignore")  # what is infinite ends it
    def end_round(self) -> bool | None:
        """Whether what was guessed agrees with what it led to; None where no other guess is left to be made."""
        values, n = self._exchange.values, self.guess_count
        self._reached[:] = [values[k] for k in self.reals]
        distance = np.abs(self._reached - self._guess)
        larger = np.maximum(np.abs(self._guess), np.abs(self._reached))
        scale = self._absolute + self._relative * larger + 1e-300
        self._error[:] = distance / scale
        if self.round == 1:  # the size of each value, for the method that combines them
            self._scale[:] = scale
        self._sizes[self.round - 1] = size = _largest(distance / self._scale)
        self._differ[:] = [before != values[k] for before, k in zip(self._before, self.others, strict=True)]
        self._head[_COMPARED] += 1.0
        if not (self._error > 1.0).any() and not self._differ.any():
            self._count(self.round, _largest(self._error))
            return True
        following = self._follow(self._guess[:n] / self._scale[:n], self._reached[:n] / self._scale[:n])
        following = following * self._scale[:n]
        is_hopeless = size > _HOPELESS * max(float(self._sizes[0]), 1.0)
        if not np.isfinite(following).all() or is_hopeless or self.round == self.stepping.max_iterations:
            return None
        for k, value in zip(self.reals[:n], following.tolist(), strict=True):
            values[k] = value
        return False

    def give_up(self, time: float, length: float) -> None:
        """Let the last iterate, of which the FMUs' states are, stand though nothing agreed, if the system says so.

        Args:
            time: where the step begins, in s.
            length: of the step, in s.

        Raises:
            CouplingError: nothing may stand.
        """
        sizes = self._sizes[: int(self._head[_COMPARED])]
        is_wild = not np.isfinite(self._reached).all() or sizes[-1] > _GROWN * sizes[0]
        if self.stepping.unsettled == "stop" or is_wild:
            raise self._failure(time, length)
        for k, value in zip(self.reals, self._reached.tolist(), strict=True):
            self._exchange.values[k] = value
        self._count(len(sizes), 0.0)
        self.unsettled.append(time)

    def _count(self, rounds: int, worst: float) -> None:
        self._head[_ROUNDS] += rounds
        self._head[_MOST] = max(self._head[_MOST], rounds)
        self._head[_RESIDUAL] = max(self._head[_RESIDUAL], worst)
        self._head[_COMPARED] = 0.0

    def counted(self) -> tuple[int, int, float]:
        """Of all steps the number of rounds, the most of them, and the largest error in units of the tolerance."""
        return int(self._head[_ROUNDS]), int(self._head[_MOST]), float(self._head[_RESIDUAL])

    def explain(self, failure: FmuError, time: float, length: float) -> RunError:
        """What to raise where an FMU has failed in a round of the step from a time of a length, both in s."""
        if self.round == 1 or isinstance(failure, StoppedError):
            return failure
        return self._failure(time, length, str(failure).partition("\n")[0])

    def _failure(self, time: float, length: float, said: str = "") -> CouplingError:
        """What to say of iterations that led nowhere.

        Args:
            time: where the step begins, in s.
            length: of the step, in s.
            said: what an FMU failed of in the round after the last that was compared, if it did.
        """
        sizes = self._sizes[: int(self._head[_COMPARED])].tolist()
        wrong = [self.reals[k] for k in np.argsort(self._error)[::-1] if self._error[k] > 1.0]
        wrong += [k for k, differs in zip(self.others, self._differ, strict=True) if differs]
        names = ", ".join(self._exchange.signals[k] for k in wrong[:_SHOWN])
        grows = bool(said) or sizes[-1] > _GROWN * sizes[0]
        worst = _largest(self._error)
        what = f"still disagree by {worst:.3g} times the tolerance" if worst > 1.0 else "still change"
        if said:
            what += f", and with the next guess an FMU fails ({said})"
        enough = 0.0
        if worst > 1.0 and not grows:
            coarsest = max(self._relative_tolerances.get(k, 0.0) for k in wrong)
            enough = _rounded_up(max(sizes[-_LAST:]) * coarsest)
        ways = ["a smaller step"]
        ways += [f"simulation.tolerance = {enough:g}"] if 0.0 < enough < _LOOSE else []
        ways += [] if grows else ["more simulation.max_iterations"]
        ways += [] if self.stepping.acceleration == "anderson" else ['simulation.acceleration = "anderson"']
        self._head[_COMPARED] = 0.0
        return CouplingError(
            f"t = {digits(time)} s: the coupling through {names} "
            f"{'diverges' if grows else 'does not converge'}: after "
            f"{len(sizes)} iterations of the step of {digits(length)} s they {what}; take "
            f"{', '.join(ways)} or a smaller "
            "simulation.relaxation"
        )


def _rounded_up(value: float) -> float:
    """The next number with one digit that is not less."""
    if not 0.0 < value < math.inf:
        return 0.0
    unit = 10.0 ** math.floor(math.log10(value))
    return math.ceil(value / unit) * unit


def _largest(errors: Vector) -> float:
    return float(errors.max(initial=0.0))
