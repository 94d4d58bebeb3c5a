"""One FMU of any version of the standard behind one face.

An archive is unpacked (`archive`), its description read into an `Interface` (`reader`, with `repair` for what tools get
wrong and `translation` for other versions), and what can be instantiated is a `Model` (`models`). An instance is a
`Slave`, whatever it is made of: an FMU in this process (`binding`), one in another (the room `isolation`), or a
component as Python objects (`plain`).
"""

from ...fmus.kinds import Kind
from .archive import Workspace
from .interface import Interface, Sort, Type, Unit, Variable
from .models import Model, load_fmu, load_models
from .reading import read as read_as_written
from .recognition import is_fmu_name
from .slave import Channel, Slave
from .snapshot import state_names, take_snapshot
from .translation import is_pedantry

__all__ = [
    "Channel",
    "Interface",
    "Kind",
    "Model",
    "Slave",
    "Sort",
    "Type",
    "Unit",
    "Variable",
    "Workspace",
    "is_fmu_name",
    "is_pedantry",
    "load_fmu",
    "load_models",
    "read_as_written",
    "state_names",
    "take_snapshot",
]
