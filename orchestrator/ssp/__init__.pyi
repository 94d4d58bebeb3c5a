from .reading import is_ssp_name, read_system

__all__ = ["is_ssp_name", "read_system"]
