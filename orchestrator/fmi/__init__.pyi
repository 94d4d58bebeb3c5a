from ...fmus.kinds import Kind
from .archive import Workspace
from .interface import Interface, Sort, Type, Unit, Variable
from .members import check_entries
from .models import Model, Packaged, load_fmu, load_models, packaged, provide
from .plain import PlainSlave
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
    "Packaged",
    "PlainSlave",
    "Slave",
    "Sort",
    "Type",
    "Unit",
    "Variable",
    "Workspace",
    "check_entries",
    "is_fmu_name",
    "is_pedantry",
    "load_fmu",
    "load_models",
    "packaged",
    "provide",
    "read_as_written",
    "state_names",
    "take_snapshot",
]
