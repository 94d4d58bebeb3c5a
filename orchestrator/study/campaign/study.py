"""`Study`: what a study has left in its directory."""

from __future__ import annotations

import json
from collections import Counter
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ... import world
from ...errors import ScenarioError
from ..analysis import Sensitivity, Summary, draw_study, outputs_of, sensitivity, summarize, summary_html
from ..design import Plan
from .columns import unified
from .dataset import METADATA, SERIES, parts_of, sorted_tables

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

STUDY_FILE = "study.json"
_MOST_OVER_TIME = 1000
"""Runs whose signals are drawn over time: of more, the memory of the client would grow with the study."""


class Study:
    """The runs of a study, read as they are asked for.

    Args:
        directory: of the study. told: what its ``study.json`` says.

    Attributes:
        directory, told: as above.
        signal: the number of the signal that ended it before its time; 0 where none did, or where it was loaded.
    """

    def __init__(self, directory: Path, told: dict[str, Any]) -> None:
        self.directory, self.told, self.signal = directory, told, 0

    @classmethod
    def load(cls, directory: str | Path) -> Study:
        """A study that was run, or still goes on.

        Raises:
            ScenarioError: the directory holds none.
        """
        path = Path(directory) / STUDY_FILE
        try:
            told = json.loads(world.read_text(path, encoding="utf-8"))
            return cls(Path(directory), {"runs": told["runs"], "status": told["status"], **told})
        except (OSError, ValueError, LookupError, TypeError, RecursionError) as error:
            raise ScenarioError(f"{directory} holds no study that can be read: {error}") from error

    def table(self, columns: list[str] | None = None) -> pa.Table:
        """The runs that are there, sorted by number, as an Arrow table with the study in its metadata.

        Args:
            columns: those that are wanted; all by default.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        parts = parts_of(self.directory)
        schemas = [pq.read_schema(part) for part in parts]
        schema = unified(schemas, self.told["dimensions"], self.told["evaluated"])
        if columns is not None:
            schema = pa.schema([field for field in schema if field.name in ("run", *columns)])
        tables = list(sorted_tables(parts, schema))
        table = pa.concat_tables(tables) if tables else schema.empty_table()
        return table.replace_schema_metadata({METADATA: json.dumps(self.told).encode()})

    def frame(self) -> pd.DataFrame:
        """The runs that are there as a pandas frame, a row each, by number."""
        frame: pd.DataFrame = self.table().to_pandas()
        return frame

    @cached_property
    def plan(self) -> Plan:
        """What was to be run."""
        return Plan.from_json(self.told["plan"])

    def summary(self, *, level: float = 0.95) -> Summary:
        """How often requirements hold and how metrics are spread, with intervals of a level of confidence."""
        return summarize(self.frame(), self.plan, level=level)

    def sensitivities(self) -> list[Sensitivity]:
        """What the parameters do to each output, the outputs of interest first."""
        frame = self.frame()
        return [sensitivity(frame, self.plan, name) for name in outputs_of(frame)]

    def draw(self) -> list[Path]:
        """Draw the pictures of what came out into the directory, as far as there is anything.

        Returns:
            The files.
        """
        import pyarrow.parquet as pq

        series = None
        if (self.directory / SERIES).is_dir():
            few = [("run", "<", _MOST_OVER_TIME)]
            series = pq.read_table(self.directory / SERIES, filters=few).to_pandas().sort_values("run", kind="stable")
        title = str(self.told["title"] or self.told["scenario"])
        return draw_study(self.frame(), self.plan, self.directory, title=title, series=series)

    def series(self, run: int) -> pd.DataFrame:
        """What was recorded of a run.

        Raises:
            ScenarioError: nothing was.
        """
        import pyarrow.parquet as pq

        if not (self.directory / SERIES).is_dir():
            raise ScenarioError(f"{self.directory} has no {SERIES}: nothing was recorded; name signals by --record")
        frame: pd.DataFrame = pq.read_table(self.directory / SERIES, filters=[("run", "==", run)]).to_pandas()
        return frame

    def row(self, run: int) -> dict[str, Any]:
        """One run, by column.

        Raises:
            ScenarioError: it is not there.
        """
        import pyarrow.parquet as pq

        for part in parts_of(self.directory):
            found = pq.read_table(part, filters=[("run", "==", run)]).to_pylist()
            if found:
                return dict(found[0])
        count = self.told["runs"]
        missing = (
            "is still missing; --resume runs it" if 0 <= run < count else f"is none of its {count}, 0 to {count - 1}"
        )
        raise ScenarioError(f"{self.directory}: run {run} {missing}")

    @cached_property
    def counts(self) -> Counter[str]:
        """How many runs there are of each status."""
        return Counter(self.table(["status"])["status"].to_pylist())

    @cached_property
    def verdicts(self) -> dict[str, Counter[str]]:
        """How many verdicts of each kind every requirement has."""
        names = [name for name in self._columns if name.startswith("verdict.")]
        table = self.table(names)
        return {
            name.removeprefix("verdict."): Counter(x for x in table[name].to_pylist() if x is not None)
            for name in table.column_names
            if name in names
        }

    @property
    def errors(self) -> dict[int, str]:
        """What is said of runs that failed or could not be run, by number."""
        table = self.table(["error"])
        pairs = zip(table["run"].to_pylist(), table["error"].to_pylist(), strict=True)
        return {run: error for run, error in pairs if error}

    @property
    def broken(self) -> int:
        """How many runs failed or could not be run."""
        return self.counts["failed"] + self.counts["refused"]

    @property
    def failed(self) -> bool:
        """Whether a run failed, or a requirement in one."""
        return bool(self.broken) or any(counts["fail"] for counts in self.verdicts.values())

    def __len__(self) -> int:
        return sum(self.counts.values())

    def __bool__(self) -> bool:
        return True  # a study is there, whatever was run of it

    def __repr__(self) -> str:
        name = " ".join(filter(None, (self.told.get("scenario"), self.told.get("preset"))))
        failing = ", ".join(
            f"{name} fails in {counts['fail']}" for name, counts in self.verdicts.items() if counts["fail"]
        )
        facts = [f"{len(self)} of {self.told['runs']} runs", str(self.told["status"])]
        facts += [f"{self.broken} failed"] if self.broken else []
        facts += [failing] if failing else []
        return f"<Study of {name}: {'; '.join(facts)}; files in {self.directory}>"

    def _repr_html_(self) -> str:
        """What a notebook shows: how often requirements hold, how metrics are spread, and what failed."""
        return summary_html(self.summary(), str(self.told["title"] or self.told["scenario"]))

    @cached_property
    def _columns(self) -> list[str]:
        import pyarrow.parquet as pq

        found: dict[str, None] = {}
        for part in parts_of(self.directory):
            found.update(dict.fromkeys(pq.read_schema(part).names))
        return list(found)
