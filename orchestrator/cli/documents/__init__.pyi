from .analysis import compare_document, linearize_document, recorded_document
from .answer import Answer, answering, fail, failed, wants_json
from .catalogue import DOCUMENTS
from .driving import drive_document
from .envelope import Document, Failure, Mistake
from .listing import list_document
from .models import describe_document, export_document, new_document, pack_document, validate_document
from .plain import plain, text_of
from .runs import CaseDocument, reproduce_document, run_document
from .scenarios import check_document, scenario_document
from .searches import falsify_document, optimize_document
from .studies import replay_document, study_document
from .written import FilesDocument, written

__all__ = [
    "DOCUMENTS",
    "Answer",
    "CaseDocument",
    "Document",
    "Failure",
    "FilesDocument",
    "Mistake",
    "answering",
    "check_document",
    "compare_document",
    "describe_document",
    "drive_document",
    "export_document",
    "fail",
    "failed",
    "falsify_document",
    "linearize_document",
    "list_document",
    "new_document",
    "optimize_document",
    "pack_document",
    "plain",
    "recorded_document",
    "replay_document",
    "reproduce_document",
    "run_document",
    "scenario_document",
    "study_document",
    "text_of",
    "validate_document",
    "wants_json",
    "written",
]
