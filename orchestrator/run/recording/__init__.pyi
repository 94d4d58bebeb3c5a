from .binary import remove_rows
from .formats import ENDINGS as RESULT_ENDINGS
from .formats import check_ending
from .recorder import ROWS_FILE, SEEN_FILE, Due, Recorder
from .recording import Recording, check_stored
from .results import Results
from .spacing import kept_signals
from .stored import Telling, finish_rows, recover_rows
from .text import CSV_FILE
from .told import check_size, read_json

__all__ = [
    "CSV_FILE",
    "RESULT_ENDINGS",
    "ROWS_FILE",
    "SEEN_FILE",
    "Due",
    "Recorder",
    "Recording",
    "Results",
    "Telling",
    "check_ending",
    "check_size",
    "check_stored",
    "finish_rows",
    "kept_signals",
    "read_json",
    "recover_rows",
    "remove_rows",
]
