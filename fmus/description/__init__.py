"""``modelDescription.xml`` of every kind of FMU and version of FMI, and what FMI 3.0 has beside it."""

from .companions import companions
from .dialect import ModelExchange
from .fmi2 import SOURCE
from .text import arguments
from .writer import default_step, write

__all__ = ["SOURCE", "ModelExchange", "arguments", "companions", "default_step", "write"]
