from .documents import OWN
from .package import list_variants
from .reading import is_ssp_name, read_system

__all__ = ["OWN", "is_ssp_name", "list_variants", "read_system"]
