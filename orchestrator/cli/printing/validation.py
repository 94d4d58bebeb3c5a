"""What was found about an FMU, as a table."""

from __future__ import annotations

from collections import Counter

from rich.console import Console
from rich.text import Text

from ...validation import Report
from .console import say
from .tables import table, verdict


def show_report(out: Console, report: Report) -> None:
    """One row a check, and the verdict in a line."""
    made = table("", ("check", "verdict", "what was found"), fold=("what was found",))
    for finding in report.findings:
        made.add_row(Text(finding.check), verdict(finding.verdict), Text(finding.detail))
    say(out, f"{report.path}: {report.interface.model}", "bold")
    out.print(made)
    found = Counter(finding.verdict for finding in report.findings)
    told = ", ".join(f"{found[word]} {word}" for word in ("pass", "note", "warning", "fail", "skipped") if found[word])
    say(out, f"{'valid' if report.passed else 'not valid'}: {told}", "green" if report.passed else "bold red")
