"""What a search has found."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from ...bars import progress_bar
from ..lines import and_figures, counted, tell
from .console import open_console, say
from .progress import tell_pool
from .tables import table

if TYPE_CHECKING:
    from ...driving import Optimum
    from ...study import Pool
    from ...study.search import Falsified, Optimized

_MOST_LINES = 12
"""So many points of a Pareto front are shown; all are files."""


@dataclass
class ShownSearch:
    """What is told of a search while it goes on.

    Attributes:
        progress: is called with how many runs are done, of how many, and what is best so far.
        begun: is called with the workers once they are there.
    """

    progress: Callable[[int, int, str], None]
    begun: Callable[[Pool], None]


@contextmanager
def show_search(title: str, quiet: bool) -> Iterator[ShownSearch]:
    """A bar over the runs of a search on a terminal, a line each 10 % otherwise, nothing when quiet."""
    if quiet:
        yield ShownSearch(lambda *_: None, lambda _: None)
    elif sys.stderr.isatty():
        with progress_bar(title, console=open_console(stderr=True)) as bar:

            def show(done: int, of: int, best: str) -> None:
                bar.count(done, of, ", ".join(filter(None, (f"{done} of {of} runs", best))))

            yield ShownSearch(show, tell_pool)
    else:
        yield ShownSearch(_lines(title), tell_pool)


def _lines(title: str) -> Callable[[int, int, str], None]:
    told = 0

    def show(done: int, of: int, best: str) -> None:
        nonlocal told
        if 10 * done // of > told:
            told = 10 * done // of
            tell(f"{title}: {done} of {of} runs" + (f", {best}" if best else ""))

    return show


def show_falsified(result: Falsified, quiet: bool) -> None:
    """What breaks the requirement and where, or how near the search came."""
    out, found = open_console(), result.found
    _show_errors(out, found.failed, found.errors)
    if result.verdict is None or result.scenario is None:
        margin = math.nan if found.nearest is None else found.nearest.margins.get(found.requirement, math.nan)
        nearest = (
            ""
            if found.nearest is None or math.isnan(margin)
            else f"; least margin {margin:.6g}, run {found.nearest.run}"
        )
        say(out, f"{found.requirement} was not broken in {counted(found.runs, 'run')}{nearest}", "green")
        _show_files(out, quiet, result, ["runs.parquet"])
        return
    verdict = result.verdict
    by = "" if verdict.margin is None else f" by {abs(verdict.margin):.6g}"
    at = "" if verdict.time is None else f" at {verdict.time:g} s"
    at += "" if verdict.index is None else f", i = {verdict.index}"
    say(out, f"{found.requirement} is broken{by}{at}, after {counted(found.runs, 'run')}", "bold red")
    if not quiet:
        say(out, f"The smallest change that still breaks it, after {counted(found.shrinking, 'more run')}:")
        for line in result.changes:
            say(out, f"    {line}")
    _show_files(out, quiet, result, [result.scenario.name, "nominal.toml", "runs.parquet"])


def show_optimized(result: Optimized, quiet: bool) -> None:
    """The best values, or the Pareto front."""
    out, found = open_console(), result.found
    _show_errors(out, found.failed, found.errors)
    names = list(found.objectives.values())
    if not found.best:
        say(out, f"no run of {found.runs} keeps {', '.join(found.requirements) or 'a finite value'}", "bold red")
    elif not quiet:
        many = len(found.best) > 1
        title = f"{'Pareto front' if many else 'Best'} of {counted(found.runs, 'run')}"
        made = table(title, ["scenario", *names], right=names, fold=names)
        for best, path in list(zip(found.best, result.scenarios, strict=True))[:_MOST_LINES]:
            made.add_row(path.name, *(f"{value:.6g}" for value in found.values(best)))
        out.print(made)
        if len(found.best) > _MOST_LINES:
            say(out, f"and {len(found.best) - _MOST_LINES} more")
        for line in result.changes[0] if not many else ():
            say(out, f"    {line}")
    _show_files(out, quiet, result, [*(["best.toml"] if len(names) == 1 and found.best else []), "runs.parquet"])


def _show_errors(out: Console, failed: int, errors: tuple[str, ...]) -> None:
    if failed:
        say(out, f"{counted(failed, 'run')} failed: {errors[0]}", "yellow")


def _show_files(out: Console, quiet: bool, result: Falsified | Optimized, names: list[str]) -> None:
    if not quiet:
        say(out, f"Files in {result.directory}: {', '.join(names)}{and_figures(len(result.figures))}", whole=True)


def show_drive(optimum: Optimum, profile: Path, quiet: bool) -> None:
    """Energy and time, how well they are known, and where the profile is.

    Args:
        optimum: that was found.
        profile: its file.
        quiet: print energy and time alone.
    """
    out, found = open_console(), optimum.solution
    least = "least time" if optimum.case.wish.minimize == "time" else "least energy"
    if not quiet:
        say(out, optimum.case.title, "bold")
    say(out, f"{least}: {found.energy / 3.6e6:.4f} kWh in {found.time:.2f} s")
    if quiet:
        return
    meshes = ", ".join(map(str, optimum.meshes))
    changed = "" if optimum.change is None else f", the last of which changed it by {100.0 * optimum.change:.2g} %"
    say(out, f"meshes of {meshes} intervals{changed}")
    say(
        out,
        f"errors: {found.feasibility:.1e} of constraints, {found.optimality:.1e} of optimality, "
        f"{optimum.mesh_error:.1e} m/s of the mesh",
    )
    say(out, f"Profile: {profile}", whole=True)
