"""A `Plan` of what people write: options of the command line, or the `[study]` of a scenario."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ...errors import ScenarioError
from ...problems import Problem, suggestion
from ...system import System
from .dimensions import Dimension
from .plan import Plan, grid_size
from .sampling import DESIGNS

_LARGEST_SEED = 2**63 - 1


def make_plan(
    system: System,
    vary: Sequence[str] = (),
    *,
    runs: int | None = None,
    seed: int | None = None,
    design: str | None = None,
) -> Plan:
    """The plan of a study.

    Where `vary` is given, the scenario's `[study]` counts no more: its number of runs is meant for its own dimensions.

    Args:
        system: the scenario, for its `[study]`.
        vary: what is varied, each as `--vary` takes it: `"cruise.alpha=0.005:0.05:10"`.
        runs: how many; None for a grid, which has as many as it has points.
        seed: of the study, from 0 to 2**63 - 1; 0 by default.
        design: one of `DESIGNS`; None for a random one where `runs` are given, else a grid.

    Raises:
        ScenarioError: something of it cannot be read, or does not go together; with every such problem.
    """
    problems: list[Problem] = []
    stated = {} if vary else system.study
    origins = system.provenance.origins
    table = origins.get("study", "[study]")
    dimensions = _parsed(vary, problems) if vary else _tabled(system, problems)
    runs_at, design_at = "--runs", "--design"
    if runs is None and "runs" in stated:
        runs, runs_at = stated["runs"], f"{origins.get('study.runs', table)}: study.runs"
    if design is None and "design" in stated:
        design, design_at = stated["design"], f"{origins.get('study.design', table)}: study.design"
    seed = stated.get("seed", 0) if seed is None else seed
    _check_names(dimensions, problems)
    if runs is not None and runs < 1:
        problems.append(Problem(runs_at, f"takes a whole number of runs, at least 1, not {runs}"))
    if not 0 <= seed <= _LARGEST_SEED:
        problems.append(Problem("--seed", f"takes a whole number from 0 to 2**63 - 1, not {seed}"))
    if design is not None and design not in DESIGNS:
        near = suggestion(str(design), DESIGNS) or f"there are {', '.join(DESIGNS)}"
        problems.append(Problem(design_at, f"there is no design '{design}'", near))
    if problems:
        raise ScenarioError(problems)
    varied = tuple(one for one, _ in dimensions)
    if design is None:
        design = "grid" if runs is None else "random"
    if design == "grid":
        _check_grid(dimensions, runs, runs_at)
        return Plan(varied, design, grid_size(varied), seed)
    if runs is None:
        raise ScenarioError(Problem(design_at, f"'{design}' needs a number of runs", "give --runs 1000"))
    if design != "random" and not varied:
        raise ScenarioError(Problem(design_at, f"'{design}' has nothing to vary", "give --vary, or take 'random'"))
    if design == "saltelli":
        _check_saltelli(len(varied), runs, runs_at)
    return Plan(varied, design, runs, seed)


def plan_notes(plan: Plan) -> list[str]:
    """What a user should know of a plan beforehand, in sentences."""
    base = plan.count // (len(plan.dimensions) + 2) if plan.design == "saltelli" else plan.count
    if plan.design not in ("sobol", "saltelli") or base & (base - 1) == 0:
        return []
    below = 1 << (base.bit_length() - 1)
    what = "points" if plan.design == "sobol" else "blocks"
    balanced = f"a Sobol sequence is balanced for a number of {what} that is a power of 2"
    return [f"{balanced}: {below} or {2 * below}, not {base}"]


def _parsed(vary: Iterable[str], problems: list[Problem]) -> list[tuple[Dimension, str]]:
    """The dimensions of `--vary`, each with its place."""
    found = []
    for text in vary:
        try:
            found.append((Dimension.parse(text), f"--vary {text}"))
        except ScenarioError as error:
            problems += error.problems
    return found


def _tabled(system: System, problems: list[Problem]) -> list[tuple[Dimension, str]]:
    """The dimensions of `[study.vary]`, each with its place."""
    found = []
    for name, what in system.study.get("vary", {}).items():
        place = system.provenance.origins.get(f"study.vary.{name}", f"study.vary.{name}")
        try:
            found.append((Dimension.read(name, what), place))
        except ScenarioError as error:
            problems += error.at(place)
    return found


def _check_names(dimensions: list[tuple[Dimension, str]], problems: list[Problem]) -> None:
    seen: dict[str, str] = {}
    for one, place in dimensions:
        if one.name in seen:
            problems.append(Problem(place, f"'{one.name}' is varied twice", f"also by {seen[one.name]}"))
        seen[one.name] = place


def _check_grid(dimensions: list[tuple[Dimension, str]], runs: int | None, runs_at: str) -> None:
    if not dimensions:
        remedy = "give --vary cruise.alpha=0.005:0.05:10, or write [study.vary] into the scenario"
        raise ScenarioError(Problem("", "nothing is varied", remedy))
    drawn = [Problem(place, "a distribution has no grid", "give --runs 1000") for one, place in dimensions if one.law]
    if drawn:
        raise ScenarioError(drawn)
    if runs is not None:
        size = grid_size(tuple(one for one, _ in dimensions))
        remedy = "leave runs out, or take --design random"
        raise ScenarioError(Problem(runs_at, f"a grid has as many runs as it has points, {size}", remedy))


def _check_saltelli(width: int, runs: int, runs_at: str) -> None:
    rows = width + 2
    if runs % rows or runs < 2 * rows:
        power = 1 << (max(2, runs // rows).bit_length() - 1)
        blocks = "blocks" if runs >= 2 * rows else "two blocks or more"
        message = f"'saltelli' takes {blocks} of {rows} runs, not {runs} runs"
        raise ScenarioError(Problem(runs_at, message, f"take {power * rows} or {2 * power * rows}"))
