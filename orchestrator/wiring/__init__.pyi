from .graphs import circles, condensed, generations, graph_of, in_sequence, leading_to
from .inputs import unmet_samples
from .links import Link, Wiring, described, is_direct
from .order import Order, derive_order
from .resolution import wire
from .starts import Known, as_text, bounded, find_starts
from .topology import describe_topology
from .trains import Control, Following, Quantity, Train, find_controls, find_followings, find_trains
from .units import convert

__all__ = [
    "Control",
    "Following",
    "Known",
    "Link",
    "Order",
    "Quantity",
    "Train",
    "Wiring",
    "as_text",
    "bounded",
    "circles",
    "condensed",
    "convert",
    "derive_order",
    "describe_topology",
    "described",
    "find_controls",
    "find_followings",
    "find_starts",
    "find_trains",
    "generations",
    "graph_of",
    "in_sequence",
    "is_direct",
    "leading_to",
    "unmet_samples",
    "wire",
]
