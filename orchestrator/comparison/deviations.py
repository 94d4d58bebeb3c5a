"""What a comparison of recorded results finds: of each of them, how far its signals depart from a reference."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from ..run import Results
from .tubes import Departure, Tube


@dataclass(frozen=True)
class Deviation:
    """One signal of one of the results.

    Attributes:
        signal: its name. unit: of it, as the reference has it.
        tube: how far it may depart. departure: how far it does.
    """

    signal: str
    unit: str
    tube: Tube
    departure: Departure

    @property
    def inside(self) -> bool:
        """Whether all its points are."""
        return not self.departure.outside

    @property
    def relative(self) -> float:
        """The distance of its worst point in heights of the tube."""
        return self.departure.distance / self.tube.height


@dataclass(frozen=True)
class Tested:
    """Results that were compared with the reference.

    Attributes:
        name: as given. results: what they are.
        deviations: signal by signal, the worst first.
        lacking: signals that the reference has and these have not. more: those that these alone have.
        notes: what else was seen. short: why the reference is not covered in time; empty where it is.
    """

    name: str
    results: Results
    deviations: list[Deviation]
    lacking: list[str]
    more: list[str]
    notes: list[str]
    short: str

    @property
    def same(self) -> bool:
        """Whether everything is inside, and the time of the reference covered."""
        return not self.short and all(one.inside for one in self.deviations)


@dataclass
class RecordedComparison:
    """Results against a reference.

    Attributes:
        reference: its name. results: what it is.
        tested: the others. directory: where the files are, if anywhere. figures: those that were drawn.
    """

    reference: str
    results: Results
    tested: list[Tested]
    directory: Path | None = None
    figures: list[Path] = field(default_factory=list)

    @property
    def same(self) -> bool:
        """Whether all are."""
        return all(one.same for one in self.tested)
