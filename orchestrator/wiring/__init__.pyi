from .inputs import unmet_samples
from .links import Link, Wiring, described, is_direct
from .order import Order, derive_order
from .resolution import wire
from .starts import bounded
from .topology import describe_topology
from .trains import Control, Following, Quantity, Train, find_controls, find_followings, find_trains

__all__ = [
    "Control",
    "Following",
    "Link",
    "Order",
    "Quantity",
    "Train",
    "Wiring",
    "bounded",
    "derive_order",
    "describe_topology",
    "described",
    "find_controls",
    "find_followings",
    "find_trains",
    "is_direct",
    "unmet_samples",
    "wire",
]
