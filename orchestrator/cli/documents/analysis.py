"""The documents of commands that compare and analyse: compare, linearize."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ...comparison import Comparison, RecordedComparison, Row
from ...run import Finding

if TYPE_CHECKING:
    from ...linearization import Linearization, Passing, Stability


@dataclass(frozen=True)
class VariantDocument:
    """A variant: what ran, how it ended, and whether what was found lets it win anything."""

    name: str
    scenario: str
    preset: str | None
    modified: bool
    status: str
    error: str
    findings: list[Finding]
    can_win: bool
    directory: str | None


@dataclass(frozen=True)
class CompareDocument:
    """Variants side by side.

    Attributes:
        rows: one for each metric and index; `values` in the order of the variants, `winners` by their number from 0.
        requirements: verdicts in the order of the variants. wins: how many rows each wins alone.
    """

    variants: list[VariantDocument]
    rows: list[Row]
    requirements: dict[str, list[str]]
    wins: list[int]
    directory: str | None
    figures: list[str]
    report: str | None


def compare_document(comparison: Comparison, report: Path | None) -> CompareDocument:
    """The document of a comparison.

    Args:
        comparison: of variants that were run.
        report: the page that was made.
    """
    variants = [
        VariantDocument(
            v.name,
            v.system.provenance.name,
            v.system.provenance.preset,
            v.system.provenance.modified,
            v.status,
            v.error,
            v.run.findings if v.run else [],
            not v.spoiled,
            str(v.directory) if v.directory else None,
        )
        for v in comparison.variants
    ]
    return CompareDocument(
        variants,
        comparison.rows,
        comparison.verdicts(),
        comparison.wins(),
        str(comparison.directory) if comparison.directory else None,
        [str(path) for path in comparison.figures],
        None if report is None else str(report),
    )


@dataclass(frozen=True)
class DeviationDocument:
    """A signal against the reference: the distance of its worst point, at a time in s, and how large it may be."""

    signal: str
    unit: str
    inside: bool
    distance: float
    height: float
    width: float
    at: float
    value: float
    outside: int
    points: int


@dataclass(frozen=True)
class TestedDocument:
    """Results that were compared with the reference.

    Attributes:
        short: why they do not cover its time. lacking: signals that it has alone. more: signals that these have alone.
    """

    name: str
    same: bool
    short: str
    signals: list[DeviationDocument]
    lacking: list[str]
    more: list[str]
    notes: list[str]


@dataclass(frozen=True)
class RecordedDocument:
    """Recorded results, of which the first is the reference of the others."""

    reference: str
    same: bool
    tested: list[TestedDocument]
    directory: str | None
    figures: list[str]


def recorded_document(comparison: RecordedComparison) -> RecordedDocument:
    """The document of a comparison of recorded results."""
    tested = [
        TestedDocument(
            one.name,
            one.same,
            one.short,
            [
                DeviationDocument(
                    row.signal,
                    row.unit,
                    row.inside,
                    row.departure.distance,
                    row.tube.height,
                    row.tube.width,
                    row.departure.at,
                    row.departure.value,
                    row.departure.outside,
                    row.departure.points,
                )
                for row in one.deviations
            ],
            one.lacking,
            one.more,
            one.notes,
        )
        for one in comparison.tested
    ]
    directory = str(comparison.directory) if comparison.directory else None
    return RecordedDocument(
        comparison.reference, comparison.same, tested, directory, [str(path) for path in comparison.figures]
    )


@dataclass(frozen=True)
class ModeDocument:
    """A mode: its eigenvalue in 1/s, frequency in rad/s, time constant in s, and the states that move most in it."""

    real: float
    imaginary: float
    count: int
    damping: float
    frequency: float
    time_constant: float
    states: list[str]
    seen: bool


@dataclass(frozen=True)
class PassingDocument:
    """How a disturbance passes from one to the next: its peak, where in rad/s, and whether it stays below 1."""

    quantity: str
    pair: str
    peak: float
    at: float
    holds: bool


@dataclass(frozen=True)
class LinearizeDocument:
    """A linear model; its matrices are in linear.json.

    Attributes:
        time, step: in s; no step of a continuous model. text: the verdict in words.
    """

    scenario: str
    preset: str | None
    time: float
    step: float | None
    states: list[str]
    inputs: list[str]
    outputs: list[str]
    verdict: str
    text: str
    modes: list[ModeDocument]
    string_stability: list[PassingDocument]
    notes: list[str]
    directory: str
    figures: list[str]


def linearize_document(
    model: Linearization,
    stability: Stability,
    passings: Sequence[Passing],
    directory: Path,
    figures: Sequence[Path],
) -> LinearizeDocument:
    """The document of a linear model.

    Args:
        model: that is linear.
        stability: its modes.
        passings: its string stability.
        directory: with its files.
        figures: that were drawn.
    """
    origin = model.system.provenance
    modes = [
        ModeDocument(m.pole.real, m.pole.imag, m.count, m.damping, m.frequency, m.time_constant, list(m.states), m.seen)
        for m in stability.modes
    ]
    return LinearizeDocument(
        origin.name,
        origin.preset,
        model.time,
        model.step,
        list(model.states),
        list(model.inputs),
        list(model.outputs),
        stability.verdict,
        stability.text,
        modes,
        [PassingDocument(p.quantity, p.pair, p.peak, p.at, bool(p.holds)) for p in passings],
        list(model.notes),
        str(directory),
        [str(path) for path in figures],
    )
