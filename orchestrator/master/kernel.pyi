from typing import Any

HAS_THREADS: int
LAYOUT: int

def look(swings: Any, number: int, values: Any) -> None: ...
def texts() -> Any: ...
def number(texts: Any, text: bytes) -> int: ...
def text(texts: Any, number: float) -> bytes: ...
def count(texts: Any) -> int: ...
def watch(address: int) -> None: ...
def run(
    operations: Any,
    parts: Any,
    channels: Any,
    instances: Any,
    entries: Any,
    references: Any,
    forms: Any,
    courses: Any,
    notes: Any,
    loops: Any,
    solvers: Any,
    parties: Any,
    terms: Any,
    passed: Any,
    points: Any,
    states: Any,
    work: Any,
    stamps: Any,
    changes: Any,
    kept: Any,
    values: Any,
    history: Any,
    newest: int,
    table: Any,
    row: int,
    places: Any,
    disturbed: Any,
    control: Any,
    texts: Any,
    every: int,
    start: float,
    step: float,
    first: int,
    count: int,
    last: int,
) -> tuple[int, int, int]: ...
