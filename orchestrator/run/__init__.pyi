from .assembly import assembled
from .checking import Checked, check, describe_stepping, signal_names, swaps
from .checkpoint import CHECKPOINT_FILE, read_checkpoint
from .directory import RunDirectory
from .ending import Interruption, conclude
from .execution import at_half_the_step, execute, go_on, resume, run
from .outcome import Run, Status
from .pacing import RealTime
from .record import add_step_check, read_metrics
from .record import read as read_record
from .recording import CSV_FILE, RESULT_ENDINGS, ROWS_FILE, Results, Telling, check_ending, read_json, recover_rows
from .repeating import Flown, Repeater, listening
from .revision import Revision
from .session import Progress
from .step_check import StepChange, StepCheck, check_step
from .watching import Finding

__all__ = [
    "CHECKPOINT_FILE",
    "CSV_FILE",
    "RESULT_ENDINGS",
    "ROWS_FILE",
    "Checked",
    "Finding",
    "Flown",
    "Interruption",
    "Progress",
    "RealTime",
    "Repeater",
    "Results",
    "Revision",
    "Run",
    "RunDirectory",
    "Status",
    "StepChange",
    "StepCheck",
    "Telling",
    "add_step_check",
    "assembled",
    "at_half_the_step",
    "check",
    "check_ending",
    "check_step",
    "conclude",
    "describe_stepping",
    "execute",
    "go_on",
    "listening",
    "read_checkpoint",
    "read_json",
    "read_metrics",
    "read_record",
    "recover_rows",
    "resume",
    "run",
    "signal_names",
    "swaps",
]
