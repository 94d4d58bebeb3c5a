from .changes import split_assignment
from .loading import dump, import_ssp, load
from .patterns import NAME
from .shipped import MODELS, Listed, listed, presets_of, raw, shipped
from .toml_source import Source, parse_value
from .trust import import_notes, untrusted_code
from .values import SEED, assignment, changed, is_structural
from .writer import dump_beside

__all__ = [
    "MODELS",
    "NAME",
    "SEED",
    "Listed",
    "Source",
    "assignment",
    "changed",
    "dump",
    "dump_beside",
    "import_notes",
    "import_ssp",
    "is_structural",
    "listed",
    "load",
    "parse_value",
    "presets_of",
    "raw",
    "shipped",
    "split_assignment",
    "untrusted_code",
]
