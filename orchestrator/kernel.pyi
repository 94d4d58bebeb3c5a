from typing import Any

def run(
    operations: Any,
    channels: Any,
    instances: Any,
    entries: Any,
    references: Any,
    changes: Any,
    values: Any,
    history: Any,
    newest: int,
    rows: Any,
    every: int,
    start: float,
    step: float,
    first: int,
    count: int,
    last: int,
    begin: int,
) -> tuple[int, int, int, int, int]: ...
