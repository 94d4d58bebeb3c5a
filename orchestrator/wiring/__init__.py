"""A system against the interfaces of its FMUs: connections resolved to scalars, converted and ordered."""

from .order import Order, derive_order
from .resolution import Link, Wiring, bounded, is_direct, wire
from .topology import describe_topology

__all__ = [
    "Link",
    "Order",
    "Wiring",
    "bounded",
    "derive_order",
    "describe_topology",
    "is_direct",
    "wire",
]
