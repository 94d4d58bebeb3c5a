"""What is said of a study or a search beside its runs: what it is, and the commands that give it and its runs again."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import ScenarioError
from ...run import read_json
from ...scenario import assignment
from ...study.analysis import Sensitivity, Summary
from ...study.campaign import Study
from .table import read_rows, varied_in

if TYPE_CHECKING:
    import pandas as pd

SEARCH_FILE = "search.json"
_OPTIONS = {
    "preset": "--preset",
    "swaps": "--swap",
    "builds": "--with",
    "settings": "--set",
    "step": "--step",
    "stop_time": "--stop",
    "algorithm": "--algorithm",
    "record": "--record",
}


@dataclass(frozen=True)
class Told:
    """A study, or a search.

    Attributes:
        title: what it is called. state: how far it came, in words. is_whole: whether it came to its end.
        frame: its runs, a row each. varied: the keys of what was varied.
        facts: what it is, as pairs of texts; commands stand among them as they are typed.
        replay: what gives a run again but for its number, which comes last; commands: of each run its own, where that
            is not so.
        axes: what the map begins with, as columns. requirement: what it is about. labels: of columns that say less.
        found: of a search what it has found: the number of its run, what is said of it, and the command that gives it.
        summary, sensitivities: of a study. study: itself.
    """

    title: str
    state: str
    is_whole: bool
    frame: pd.DataFrame
    varied: list[str]
    facts: list[tuple[str, str]]
    replay: str = ""
    commands: list[str] = field(default_factory=list)
    axes: tuple[str, ...] = ()
    requirement: str = ""
    labels: Mapping[str, str] = field(default_factory=dict)
    found: tuple[tuple[int, str, str], ...] = ()
    summary: Summary | None = None
    sensitivities: tuple[Sensitivity, ...] = ()
    study: Study | None = None


def told_of_study(directory: Path) -> Told:
    """A study.

    Raises:
        ScenarioError: the directory holds none that can be read.
    """
    study = Study.load(directory)
    told, plan = study.told, study.plan
    facts = [
        ("run again", command_of_study(told)),
        ("design", f"{plan.design}, {told['runs']} runs, seed {plan.seed}"),
        ("varied", "; ".join(f"{one.name}: {one}" for one in plan.dimensions)),
        ("versions", ", ".join(f"{name} {version}" for name, version in told.get("versions", {}).items())),
        ("Python", f"{told.get('python')} on {told.get('platform')}"),
        *((f"digest of {name}", str(digest)) for name, digest in {**told["files"], **told["components"]}.items()),
    ]
    return Told(
        title=str(told["title"] or told["scenario"]),
        state=f"{len(study)} of {told['runs']} runs, {told['status']}",
        is_whole=len(study) == told["runs"],
        frame=study.frame(),
        varied=list(told["dimensions"]),
        facts=facts,
        replay=f"{shlex.join(['orchestrate', 'replay', str(directory), '--run'])} ",
        summary=study.summary(),
        sensitivities=tuple(study.sensitivities()),
        study=study,
    )


def command_of_study(told: Mapping[str, Any]) -> str:
    """What runs a study again, as a shell takes it."""
    how, plan = told["how"], json.loads(told["plan"])
    words = ["orchestrate", "study", str(how["scenario"])]
    for key, option in _OPTIONS.items():
        given = how.get(key)
        for value in given if isinstance(given, list) else [] if given is None else [given]:
            words += [option, str(value)]
    words += [] if how.get("kind", "auto") == "auto" else ["--kind", how["kind"]]
    for one in plan["dimensions"]:
        values = one.get("law") or ",".join(json.dumps(value, ensure_ascii=False) for value in one["values"])
        words += ["--vary", f"{one['name']}={values}"]
    if plan["design"] != "grid":
        words += ["--runs", str(plan["count"])]
    return shlex.join([*words, "--seed", str(plan["seed"]), "--design", plan["design"]])


def told_of_search(directory: Path) -> Told:
    """A search for a counterexample, or for the best.

    Raises:
        ScenarioError: the directory holds none that can be read.
    """
    try:
        told = read_json(directory / SEARCH_FILE)
        frame = read_rows(directory)
        varied = varied_in(frame)
        objectives = list(map(str, told.get("minimize", ())))
        requirement = str(told.get("requirement", ""))
        runs, broken = told.get("runs", len(frame)), told.get("broken")
        found = tuple(_found(directory, told, objectives))
        facts = [("varied", "; ".join(map(str, told["vary"]))), ("seed", str(told["seed"]))]
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
        raise ScenarioError(f"{directory} holds no search that can be read: {error}") from error
    state = "" if broken is None else "; it is broken" if broken else "; it is not broken"
    labels = _labels(frame, objectives)
    return Told(
        title=f"Search for a run that breaks {requirement}"
        if requirement
        else f"Search for the least {', '.join(objectives)}",
        state=f"{runs} runs{state}",
        is_whole="runs" in told,
        frame=frame,
        varied=varied,
        facts=facts,
        commands=list(_commands(directory, frame, varied)),
        axes=(*labels, "run")[:2][:: 1 if len(labels) > 1 else -1] if labels else ("run", f"margin.{requirement}"),
        requirement=requirement,
        labels=labels,
        found=found,
    )


def _labels(frame: pd.DataFrame, objectives: Iterable[str]) -> dict[str, str]:
    """What the columns of objectives are called: those of expressions are numbered in the table."""
    found: dict[str, str] = {}
    for k, text in enumerate(objectives, 1):
        numbered = [name for name in map(str, frame) if name.rstrip("_") == f"metric.objective_{k}"]
        own = f"metric.{text}"
        found |= {own: text} if own in frame else dict.fromkeys(numbered[:1], text)
    return found


def _found(directory: Path, told: Mapping[str, Any], objectives: Iterable[str]) -> Iterator[tuple[int, str, str]]:
    """What a search has found."""
    if told.get("broken"):
        changes = (
            ", ".join(f"{name} = {value}" for name, value in told["changes"].items()) or "the scenario as it stands"
        )
        said = f"counterexample, margin {told['margin']} at {told['time']} s: {changes}"
        yield -1, said, shlex.join(["orchestrate", "run", str(directory / "counterexample.toml")])
    elif told.get("nearest"):
        yield int(told["nearest"]["run"]), f"the nearest to it, margin {told['nearest']['margin']}", ""
    for one in told.get("best", ()):
        said = ", ".join(f"{name} = {value:.6g}" for name, value in zip(objectives, one["values"], strict=True))
        yield int(one["run"]), said, shlex.join(["orchestrate", "run", str(directory / str(one["scenario"]))])


def _commands(directory: Path, frame: pd.DataFrame, varied: Iterable[str]) -> Iterator[str]:
    """What gives each run of a search again: its scenario, with what it changes."""
    import pandas as pd

    keys = list(varied)
    for row in frame[keys].astype(object).itertuples(index=False):
        words = ["orchestrate", "run", str(directory / "nominal.toml")]
        for key, value in zip(keys, row, strict=True):
            if not pd.isna(value):
                plain = value.item() if hasattr(value, "item") else value
                words += ["--swap", f"{key}={plain}"] if "." not in key else ["--set", assignment(key, plain)]
        yield shlex.join(words)
