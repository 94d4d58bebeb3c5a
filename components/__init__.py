"""The equations: trains, controllers and their surroundings. Imports NumPy and nothing of this project.

`CATALOGUE` is the one table of shipped components; each name imports from here.
"""

from .component import Component, ComponentError
from .cruise.comfort import ComfortCruise
from .cruise.port import CruiseController
from .declarations import Data, Input, Memory, Noise, Output, Parameter, Size, State, Tape
from .environment.gust import Gust
from .environment.schedule import Schedule
from .simulate import Simulation, simulate
from .trains.point_mass import PointMassTrain
from .trains.port import DavisResistance, Train

CATALOGUE: dict[str, type[Component]] = {
    component.__name__: component for component in (PointMassTrain, ComfortCruise, Schedule, Gust)
}

__all__ = [
    "CATALOGUE",
    "ComfortCruise",
    "Component",
    "ComponentError",
    "CruiseController",
    "Data",
    "DavisResistance",
    "Gust",
    "Input",
    "Memory",
    "Noise",
    "Output",
    "Parameter",
    "PointMassTrain",
    "Schedule",
    "Simulation",
    "Size",
    "State",
    "Tape",
    "Train",
    "simulate",
]
