"""`CATALOGUE`: the one table of the shipped components."""

from __future__ import annotations

from .ato.adaptive import AdaptiveAto
from .ato.ailc import Ailc
from .ato.cailc import Cailc
from .ato.force_distribution import ForceDistribution
from .ato.learning_energy import LearningEnergy
from .ato.pd_ilc import PdIlc
from .ato.pid import PidAto
from .component import Component
from .cruise.comfort import ComfortCruise
from .cruise.fault_tolerant import BacksteppingCruise, FaultTolerantCruise, FaultTolerantCruiseIntermediate
from .cruise.fixed_distance import FixedDistanceCruise
from .cruise.monitors import IntermediateEstimator, StateFaultObserver
from .cruise.predictive.distributed import DistributedMpc
from .cruise.range_potential import RangePotentialCruise
from .cruise.time_headway import TimeHeadwayCruise
from .cruise.tunable_potential import TunablePotentialCruise
from .environment.actuator_faults import ActuatorFaults
from .environment.gaussian_disturbance import GaussianDisturbance
from .environment.gust import Gust
from .environment.line import Line
from .environment.radio import RadioLink
from .environment.reference_profile import ReferenceProfile
from .environment.schedule import Schedule
from .environment.sensor import Sensor
from .environment.sinusoid import Sinusoid
from .supervision.etcs import EtcsSupervision
from .supervision.etcs_driver import EtcsDriver
from .supervision.line_timetable import LineTimetable, ProfileTimetable
from .supervision.moving_block import MovingBlock
from .supervision.protection import Protection
from .supervision.timetable import Timetable
from .supervision.trip_monitor import TripMonitor
from .trains.consist import Consist
from .trains.coupled_subway import CoupledSubwayTrain
from .trains.drive import Drive
from .trains.freight_train import FreightTrain
from .trains.line_train import LineTrain
from .trains.point_mass import PointMassTrain
from .trains.subway import SubwayTrain

CATALOGUE: dict[str, type[Component]] = {
    component.__name__: component
    for component in (
        PointMassTrain,
        ComfortCruise,
        TunablePotentialCruise,
        FixedDistanceCruise,
        RangePotentialCruise,
        TimeHeadwayCruise,
        DistributedMpc,
        Schedule,
        Gust,
        Sinusoid,
        RadioLink,
        Line,
        Consist,
        FaultTolerantCruise,
        FaultTolerantCruiseIntermediate,
        BacksteppingCruise,
        StateFaultObserver,
        IntermediateEstimator,
        ReferenceProfile,
        ActuatorFaults,
        GaussianDisturbance,
        SubwayTrain,
        CoupledSubwayTrain,
        Cailc,
        Ailc,
        PdIlc,
        AdaptiveAto,
        PidAto,
        ForceDistribution,
        LearningEnergy,
        Timetable,
        LineTimetable,
        ProfileTimetable,
        Protection,
        EtcsSupervision,
        EtcsDriver,
        MovingBlock,
        TripMonitor,
        Sensor,
        LineTrain,
        FreightTrain,
        Drive,
    )
}
