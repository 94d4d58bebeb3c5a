from .ato.adaptive import AdaptiveAto
from .ato.ailc import Ailc
from .ato.cailc import Cailc
from .ato.force_distribution import ForceDistribution
from .ato.learning_energy import LearningEnergy
from .ato.pd_ilc import PdIlc
from .ato.pid import PidAto
from .ato.port import AtoController
from .catalogue import CATALOGUE
from .component import Component
from .cruise.comfort import ComfortCruise
from .cruise.fault_tolerant import BacksteppingCruise, FaultTolerantCruise, FaultTolerantCruiseIntermediate
from .cruise.fixed_distance import FixedDistanceCruise
from .cruise.guarded import GuardedCruise
from .cruise.monitors import IntermediateEstimator, StateFaultObserver
from .cruise.port import CruiseController
from .cruise.predictive.distributed import DistributedMpc
from .cruise.range_potential import RangePotentialCruise
from .cruise.time_headway import TimeHeadwayCruise
from .cruise.tunable_potential import TunablePotentialCruise
from .declarations import Data, Input, Memory, Noise, Output, Parameter, Size, State, Tape
from .environment.actuator_faults import ActuatorFaults
from .environment.gaussian_disturbance import GaussianDisturbance
from .environment.gust import Gust
from .environment.line import Line
from .environment.radio import RadioLink
from .environment.reference_profile import ReferenceProfile
from .environment.schedule import Schedule
from .environment.sensor import Sensor
from .environment.sinusoid import Sinusoid
from .errors import ComponentError
from .lookup.network import Network
from .lookup.table import Lookup
from .simulate import Simulation, simulate
from .supervision.etcs import EtcsSupervision
from .supervision.etcs_driver import EtcsDriver
from .supervision.line_timetable import LineTimetable, ProfileTimetable
from .supervision.moving_block import MovingBlock
from .supervision.protection import Protection
from .supervision.timetable import Timetable
from .supervision.trip_monitor import TripMonitor
from .trains.consist import Carriages, Consist
from .trains.coupled_subway import CoupledSubwayTrain
from .trains.drive import Drive
from .trains.freight_train import FreightTrain
from .trains.line_train import LineTrain
from .trains.point_mass import PointMassTrain
from .trains.port import DavisResistance, Train
from .trains.subway import SubwayTrain

__all__ = [
    "CATALOGUE",
    "ActuatorFaults",
    "AdaptiveAto",
    "Ailc",
    "AtoController",
    "BacksteppingCruise",
    "Cailc",
    "Carriages",
    "ComfortCruise",
    "Component",
    "ComponentError",
    "Consist",
    "CoupledSubwayTrain",
    "CruiseController",
    "Data",
    "DavisResistance",
    "DistributedMpc",
    "Drive",
    "EtcsDriver",
    "EtcsSupervision",
    "FaultTolerantCruise",
    "FaultTolerantCruiseIntermediate",
    "FixedDistanceCruise",
    "ForceDistribution",
    "FreightTrain",
    "GaussianDisturbance",
    "GuardedCruise",
    "Gust",
    "Input",
    "IntermediateEstimator",
    "LearningEnergy",
    "Line",
    "LineTimetable",
    "LineTrain",
    "Lookup",
    "Memory",
    "MovingBlock",
    "Network",
    "Noise",
    "Output",
    "Parameter",
    "PdIlc",
    "PidAto",
    "PointMassTrain",
    "ProfileTimetable",
    "Protection",
    "RadioLink",
    "RangePotentialCruise",
    "ReferenceProfile",
    "Schedule",
    "Sensor",
    "Simulation",
    "Sinusoid",
    "Size",
    "State",
    "StateFaultObserver",
    "SubwayTrain",
    "Tape",
    "TimeHeadwayCruise",
    "Timetable",
    "Train",
    "TripMonitor",
    "TunablePotentialCruise",
    "simulate",
]
