"""A system against the interfaces of its FMUs: connections resolved to scalars, converted and ordered."""

from .links import Link, Wiring, described, is_direct
from .order import Order, derive_order
from .resolution import wire
from .starts import bounded
from .topology import describe_topology

__all__ = [
    "Link",
    "Order",
    "Wiring",
    "bounded",
    "derive_order",
    "describe_topology",
    "described",
    "is_direct",
    "wire",
]
