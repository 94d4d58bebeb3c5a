"""What was found in a run without being asked: on stdout, before everything else, also when quiet."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console

from ...names import SignalName
from ...run import Finding
from .console import open_console, say

_SHOWN = 4
"""How many findings of one kind are told in full."""


def show_findings(findings: Sequence[Finding], title: str = "", out: Console | None = None) -> None:
    """A line each; of many of one kind the first few, and who the others are.

    Args:
        findings: of one run.
        title: whose they are, where there are several runs.
        out: where to; stdout by default.
    """
    out, head = out or open_console(), f"{title}: " if title else ""
    for kind in dict.fromkeys(finding.kind for finding in findings):
        alike = [finding for finding in findings if finding.kind == kind]
        style = "bold red" if alike[0].spoils else "yellow"
        for finding in alike[:_SHOWN]:
            say(out, f"{head}{finding}", style)
        if len(alike) > _SHOWN:
            names = dict.fromkeys(finding.instances[0] for finding in alike[_SHOWN:])
            say(out, f"{head}{kind}: {len(alike) - _SHOWN} more, of {_listed(names)}", style)


def _listed(names: Sequence[str] | dict[str, None]) -> str:
    """The names, or what families they are of."""
    shown = names if len(names) <= 2 * _SHOWN else dict.fromkeys(SignalName(name).family.instance for name in names)
    return ", ".join(shown)
