"""`[study]`: what is varied from run to run, and how many runs there are."""

from __future__ import annotations

from typing import Any

from .groups import Entry, is_plain, shown, whole
from .reader import Reader, flatten

STUDY_KEYS = ("runs", "seed", "design", "vary")


def read_study(reader: Reader) -> tuple[dict[str, Any], dict[str, str]]:
    """What the section says, and where: its values by key, `vary` flat; what a text of `vary` means is read later.

    What is wrong with it goes to the reader's problems.
    """
    table = reader.table(reader.source.data, "study")
    reader.check_keys(table, STUDY_KEYS, "study")
    study: dict[str, Any] = {}
    origins = {"study": reader.source.origin("study")} if table else {}
    entries = {key: reader.entry(table[key], "study", key) for key in STUDY_KEYS if key in table}
    if "runs" in entries:
        count = "a whole number of runs, at least 1"
        study["runs"] = whole(entries["runs"], reader.problems, lambda value: value >= 1, count)
    if "seed" in entries:
        fits = "a whole number from 0 to 2**63 - 1"
        study["seed"] = whole(entries["seed"], reader.problems, lambda value: 0 <= value < 2**63, fits)
    if "design" in entries:
        study["design"] = entries["design"].value
    origins |= {f"study.{key}": entry.origin for key, entry in entries.items()}
    for keys, value in flatten(reader.table(table, "vary", "study")):
        entry: Entry = reader.entry(value, "study", "vary", *keys)
        if not is_plain(value):
            reader.problems.append(entry.problem(f"takes a text, a number, or a list of values, not {shown(value)}"))
            continue
        study.setdefault("vary", {})[".".join(keys)] = value
        origins[f"study.vary.{'.'.join(keys)}"] = entry.where
    return study, origins
