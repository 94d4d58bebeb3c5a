"""What is found about an FMU."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ..fmi import Interface

Verdict = Literal["pass", "note", "warning", "fail", "skipped"]
_LISTED = 20


@dataclass(frozen=True)
class Finding:
    """One line of the verdict table."""

    check: str
    verdict: Verdict
    detail: str


@dataclass(frozen=True)
class Report:
    """What was found; `passed` unless something failed."""

    path: Path
    interface: Interface
    findings: tuple[Finding, ...]

    @property
    def passed(self) -> bool:
        """Whether nothing failed."""
        return all(finding.verdict != "fail" for finding in self.findings)


def listed(check: str, problems: Sequence[str], fine: str, verdict: Verdict = "fail") -> Finding:
    """A check that fails (or has another verdict) by any problem; `fine` is what to say where there is none."""
    more = f"\n... and {len(problems) - _LISTED} more" if len(problems) > _LISTED else ""
    return Finding(check, verdict, "\n".join(problems[:_LISTED]) + more) if problems else Finding(check, "pass", fine)
