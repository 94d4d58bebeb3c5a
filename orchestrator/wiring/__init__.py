"""A system against the interfaces of its FMUs: connections resolved to scalars, converted and ordered."""

from ...components.doors import hang_door

hang_door(__name__)
