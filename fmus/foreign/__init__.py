"""Other people's formats of lines, trains and networks, read into this project's own: units and values are checked."""

from .quantities import ForeignError
from .reading import DATA_SUFFIXES, read_data

__all__ = ["DATA_SUFFIXES", "ForeignError", "read_data"]
