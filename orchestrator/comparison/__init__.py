"""Runs side by side: variants of a scenario, and measured beside published values."""

from ...components.doors import hang_door

hang_door(__name__)
