"""Variants of a scenario side by side: their metrics in one table, with a winner where "better" is defined."""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from .. import world
from ..errors import FmuError, RailcosimError, ScenarioError
from ..figures import remarked, remove_drawn
from ..fmi import Kind
from ..markup import MOST_ROWS, escaped, number, table
from ..problems import Problem
from ..run import Progress, Run, execute, swaps
from ..scenario import load
from ..system import System
from .figures import draw_compared
from .preference import Better, better, winners

OnProgress = Callable[[str, float], AbstractContextManager[Progress | None]]
"""Given a variant's name and the start time in s: what is told how far its run has come."""


@dataclass
class Variant:
    """One column of the comparison.

    Attributes:
        name: as in the table. system: what was to run.
        run: what came out of it; None where it could not begin, or was not reached.
        error: why it failed; empty where it did not.
        directory: its own results.
    """

    name: str
    system: System
    run: Run | None = None
    error: str = ""
    directory: Path | None = None

    @property
    def status(self) -> str:
        """``"completed"``, ``"interrupted"``, ``"failed"`` or ``"not run"``."""
        if self.run is not None:
            return self.run.status
        return "failed" if self.error else "not run"

    @property
    def spoiled(self) -> bool:
        """Whether something was found in its run with which it can win nothing."""
        return self.run is not None and any(finding.spoils for finding in self.run.findings)

    def problem(self, metric: str) -> str:
        """Why a metric of a completed run has no value; empty where it has one."""
        metrics = self.run.metrics if self.run is not None and self.run.status == "completed" else ()
        return next((m.problem.removeprefix(f"'{m.expression}': ") for m in metrics if m.name == metric), "")

    def value(self, metric: str, index: int | None) -> float:
        """A metric of a completed run, NaN where there is none."""
        if self.run is None or self.run.status != "completed":
            return math.nan
        return next((m.values.get(index, math.nan) for m in self.run.metrics if m.name == metric), math.nan)


@dataclass(frozen=True)
class Row:
    """One metric, or one index of it, over all variants; NaN where a variant has none.

    ``winners`` are the places of the best values, of variants that can win; empty where there is no better, or all are
    equal. ``truth`` says that 1 is true and 0 false. ``problem`` says why a value is missing.
    """

    metric: str
    index: int | None
    unit: str
    better: Better
    values: tuple[float, ...]
    winners: tuple[int, ...]
    truth: bool = False
    problem: str = ""

    @property
    def name(self) -> str:
        """``gap[3]``."""
        return self.metric if self.index is None else f"{self.metric}[{self.index}]"


@dataclass
class Comparison:
    """Variants side by side.

    Attributes:
        variants: the columns. rows: one for each metric and index.
        directory: where ``compare.json`` and ``compare.csv`` are, if anywhere. figures: those that were drawn.
    """

    variants: list[Variant]
    rows: list[Row] = field(default_factory=list)
    directory: Path | None = None
    figures: list[Path] = field(default_factory=list)

    def __repr__(self) -> str:
        names = ", ".join(variant.name for variant in self.variants)
        return f"<Comparison of {names}: {len(self.rows)} rows>"

    def _repr_html_(self) -> str:
        """What a notebook shows: metrics side by side, the best in bold, and the verdicts."""
        rows = [
            [
                escaped(row.name),
                *(f"<b>{number(x)}</b>" if k in row.winners else number(x) for k, x in enumerate(row.values)),
                escaped(row.unit),
            ]
            for row in self.rows
        ]
        verdicts = [[escaped(name), *map(escaped, found), ""] for name, found in self.verdicts().items()]
        return table(["", *self.names, "unit"], [*verdicts, *rows], "Requirements and metrics", most=MOST_ROWS)

    @property
    def names(self) -> list[str]:
        """Of the variants."""
        return [variant.name for variant in self.variants]

    @property
    def requirement_failed(self) -> bool:
        """Whether a requirement failed in any variant."""
        return any(v.verdict == "fail" for variant in self.variants if variant.run for v in variant.run.requirements)

    @property
    def broken(self) -> bool:
        """Whether a variant failed."""
        return any(variant.status == "failed" for variant in self.variants)

    @property
    def interrupted(self) -> int:
        """The number of the signal that stopped it, so that later variants were not run; 0 where none did."""
        return max((variant.run.signal for variant in self.variants if variant.run is not None), default=0)

    def verdicts(self) -> dict[str, list[str]]:
        """Verdicts of each requirement over the variants; empty text where a variant has no such requirement."""
        found: dict[str, list[str]] = {}
        for k, variant in enumerate(self.variants):
            for verdict in variant.run.requirements if variant.run else ():
                found.setdefault(verdict.name, [""] * len(self.variants))[k] = verdict.verdict
        return found

    def wins(self) -> list[int]:
        """How many rows each variant wins alone."""
        return [sum(row.winners == (k,) for row in self.rows) for k in range(len(self.variants))]


def variants(
    scenarios: Sequence[str],
    *,
    presets: Sequence[str] = (),
    swaps: Sequence[str] = (),
    settings: Sequence[str] = (),
    builds: Sequence[str] = (),
    stop_time: float | None = None,
    step: float | None = None,
) -> dict[str, System]:
    """What to compare, by name: each scenario as it stands, then under each preset, then with each swap.

    Args:
        scenarios: paths or names.
        presets: each makes a variant of every scenario that has it.
        swaps: each makes a variant of every scenario; ``"cruise=A,train=B"`` is one variant with two changes.
        settings: values by name, as in `load`, the same for all variants; so are the other arguments.
        builds: build arguments.
        stop_time: another end in s.
        step: another communication step in s.

    Raises:
        ScenarioError: a scenario or a change is wrong, or a preset belongs to none of the scenarios.
    """
    common: Any = {"settings": settings, "builds": builds, "stop_time": stop_time, "step": step}
    found: dict[str, System] = {}
    owners: set[str] = set()
    bases = [load(scenario, **common) for scenario in scenarios]
    several = len(dict.fromkeys(scenarios)) > 1
    for scenario, base in dict(zip(scenarios, bases, strict=True)).items():
        title = (
            base.provenance.name if [b.provenance.name for b in bases].count(base.provenance.name) == 1 else scenario
        )
        start = title if several else base.provenance.default_preset or "as it stands"
        found[start] = base
        for preset in presets:
            if preset in base.provenance.presets or len(bases) == 1:
                owners.add(preset)
                if preset != base.provenance.default_preset:
                    found[f"{title} {preset}" if several else preset] = load(scenario, preset=preset, **common)
        for swap in swaps:
            parts = [part.strip() for part in re.split(r",(?=[^,]*=)", swap)]
            short = ",".join(_short(part) for part in parts)
            name = f"{title} {short}" if several else short
            found[name if name not in found else f"{title} {swap}"] = load(scenario, swaps=parts, **common)
    missing = [preset for preset in presets if preset not in owners]
    if missing:
        raise ScenarioError([Problem("", f"none of the scenarios has a preset '{preset}'") for preset in missing])
    return found


def _short(swap: str) -> str:
    """``cruise=path/to/my_controller.py:MyController`` as ``cruise=MyController``."""
    key, _, model = swap.partition("=")
    return f"{key}={model.rpartition(':')[2] if '.py:' in model else Path(model).stem}"


def compare(
    systems: Mapping[str, System],
    *,
    kind: Kind = "auto",
    output: str | Path | None = None,
    figures: bool = True,
    directions: Mapping[str, Better] | None = None,
    progress: OnProgress | None = None,
) -> Comparison:
    """Run systems one after another, and compare their metrics. One that fails does not stop the others.

    Args:
        systems: by the name they have in the table; the first gives the figures.
        kind: as for `run`.
        output: directory for ``compare.json``, ``compare.csv``, figures and a subfolder of results for each variant;
            without one everything stays in memory.
        figures: whether to draw the overlaid figures (only with an output directory).
        directions: what is better, for metrics whose expression does not say it or says it wrongly.
        progress: gives the progress callback of each run.

    Raises:
        ScenarioError: no variant could run.
    """
    directory = Path(output) if output is not None else None
    comparison = Comparison([Variant(name, system) for name, system in systems.items()], directory=directory)
    if not comparison.variants:
        raise ScenarioError(Problem("", "there is nothing to compare", "name a scenario"))
    if directory is not None:
        world.mkdir(directory, parents=True, exist_ok=True)
        remove_drawn(directory / "compare.json")
        for variant, name in zip(comparison.variants, _folders(comparison.names), strict=True):
            variant.directory = directory / name
    for variant in comparison.variants:
        _run(variant, kind, progress)
        if variant.status == "interrupted":
            break
    if all(variant.run is None for variant in comparison.variants):
        raise ScenarioError([Problem(variant.name, variant.error) for variant in comparison.variants])
    comparison.rows = _rows(comparison.variants, directions or {})
    if directory is not None:
        if figures:
            comparison.figures = _draw(comparison, directory)
        write_json(comparison, directory / "compare.json")
        write_csv(comparison, directory / "compare.csv")
    return comparison


def _run(variant: Variant, kind: Kind, progress: OnProgress | None) -> None:
    start = variant.system.stepping.start_time
    with progress(variant.name, start) if progress else nullcontext() as told:
        try:
            variant.run = execute(variant.system, kind=kind, output=variant.directory, figures=False, progress=told)
            variant.error = str(variant.run.error or "")
        except (RailcosimError, FmuError) as error:
            variant.error = str(error)


def _folders(names: Sequence[str]) -> list[str]:
    """A folder name for each variant, told apart where two give the same."""
    folders: list[str] = []
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9._-]+", "-", name).strip("-.") or "variant"
        number = sum(other == plain or other.startswith(f"{plain}~") for other in folders)
        folders.append(f"{plain}~{number + 1}" if number else plain)
    return folders


def _rows(columns: Sequence[Variant], directions: Mapping[str, Better]) -> list[Row]:
    """One row for each metric and index that any variant has, in the order in which they first occur."""
    known: dict[tuple[str, int | None], tuple[str, Better, bool]] = {}
    for variant in columns:
        for metric in variant.run.metrics if variant.run and variant.run.status == "completed" else ():
            for index in metric.values:
                direction = directions.get(metric.name) or better(metric.expression)
                known.setdefault((metric.name, index), (metric.unit, direction, metric.truth))
    order = {name: k for k, name in enumerate(dict.fromkeys(name for name, _ in known))}
    barred = [k for k, variant in enumerate(columns) if variant.spoiled]
    rows = []
    for (name, index), (unit, direction, truth) in sorted(known.items(), key=lambda item: order[item[0][0]]):
        values = tuple(variant.value(name, index) for variant in columns)
        problem = next(filter(None, (variant.problem(name) for variant in columns)), "")
        rows.append(Row(name, index, unit, direction, values, winners(values, direction, barred), truth, problem))
    return rows


def _draw(comparison: Comparison, directory: Path) -> list[Path]:
    done = {v.name: v.run.results for v in comparison.variants if v.run and len(v.run.time)}
    first = next((v.run for v in comparison.variants if v.run and len(v.run.time)), None)
    if first is None:
        return []
    reconstructed = [
        v.name
        for v in comparison.variants
        if v.run
        and "(reconstructed)" in swaps(v.run.system, {n: model.interface for n, model in v.run.checked.models.items()})
    ]
    remark = f"reconstructed in {', '.join(reconstructed)}" if reconstructed else ""
    figures = remarked(first.system.judged.figures, remark)
    return draw_compared(figures, done, directory)


# -------------------------------------------------------------------- files


def write_json(comparison: Comparison, path: Path) -> None:
    """Everything, numbers as they are; what JSON has no number for is text, what UTF-8 has no bytes for is escaped."""
    content = {
        "variants": [
            {
                "name": v.name,
                "scenario": v.system.provenance.name,
                "preset": v.system.provenance.preset,
                "modified": v.system.provenance.modified,
                "status": v.status,
                "error": v.error,
                "findings": [asdict(finding) for finding in v.run.findings] if v.run else [],
                "can_win": not v.spoiled,
                "results": v.directory.name if v.directory else None,
            }
            for v in comparison.variants
        ],
        "rows": [
            {
                "metric": row.metric,
                "index": row.index,
                "unit": row.unit,
                "better": row.better,
                "values": dict(zip(comparison.names, map(_finite, row.values), strict=True)),
                "winners": [comparison.names[k] for k in row.winners],
                "problem": row.problem,
            }
            for row in comparison.rows
        ],
        "requirements": {
            name: dict(zip(comparison.names, verdicts, strict=True)) for name, verdicts in comparison.verdicts().items()
        },
        "wins": dict(zip(comparison.names, comparison.wins(), strict=True)),
        "figures": [figure.name for figure in comparison.figures],
    }
    text = json.dumps(content, indent=1, ensure_ascii=False) + "\n"
    world.write_text(path, text, encoding="utf-8", errors="backslashreplace")


def write_csv(comparison: Comparison, path: Path) -> None:
    """The table: one line for each metric and index, one column for each variant."""
    with world.open(path, "w", newline="", encoding="utf-8", errors="backslashreplace") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["metric", "index", "unit", "better", *comparison.names, "winner"])
        for row in comparison.rows:
            best = "; ".join(comparison.names[k] for k in row.winners)
            index = "" if row.index is None else row.index
            writer.writerow([row.metric, index, row.unit, row.better, *map(repr, row.values), best])


def _finite(value: float) -> float | str:
    return value if math.isfinite(value) else repr(value)
