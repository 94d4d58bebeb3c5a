"""The document of each command."""

from __future__ import annotations

from typing import Any

from .analysis import CompareDocument, LinearizeDocument, RecordedDocument
from .driving import DriveDocument
from .listing import ListDocument
from .models import ExportDocument, ModelDocument, NewDocument, PackDocument, ValidateDocument
from .runs import ReproduceDocument, RunDocument
from .scenarios import CheckDocument, ScenarioDocument
from .searches import FalsifyDocument, OptimizeDocument
from .studies import ReplayDocument, StudyDocument
from .written import FilesDocument

DOCUMENTS: dict[str, Any] = {
    "run": RunDocument,
    "list": ListDocument,
    "import": FilesDocument,
    "export": ExportDocument,
    "check": CheckDocument,
    "plot": FilesDocument,
    "convert": FilesDocument,
    "reproduce": ReproduceDocument,
    "report": FilesDocument,
    "describe": ModelDocument | ScenarioDocument,
    "build": FilesDocument,
    "pack": PackDocument,
    "validate": ValidateDocument,
    "new": NewDocument,
    "compare": CompareDocument | RecordedDocument,
    "linearize": LinearizeDocument,
    "drive": DriveDocument,
    "falsify": FalsifyDocument,
    "optimize": OptimizeDocument,
    "study": StudyDocument,
    "replay": ReplayDocument,
}
"""The type of `Document.result` by command."""
