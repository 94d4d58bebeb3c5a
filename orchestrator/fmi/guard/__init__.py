"""Guarded calls of FMUs: which one is under way is noted, and none ends the process unnoticed or with code 0."""

from .notes import NOTE_SIZE, NOTES, Seen, described
from .watching import (
    ENDED,
    GUARD,
    dismiss,
    end_streams,
    guarded,
    introduce,
    loading,
    noted,
    own_note,
    run_guarded,
    said,
    share_notes,
    stand_aside,
    unload,
)

__all__ = [
    "ENDED",
    "GUARD",
    "NOTES",
    "NOTE_SIZE",
    "Seen",
    "described",
    "dismiss",
    "end_streams",
    "guarded",
    "introduce",
    "loading",
    "noted",
    "own_note",
    "run_guarded",
    "said",
    "share_notes",
    "stand_aside",
    "unload",
]
