from .documents import OWN
from .reading import is_ssp_name, read_system

__all__ = ["OWN", "is_ssp_name", "read_system"]
