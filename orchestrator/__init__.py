"""The master orchestrator: `System`, `load` and `run` are what a script needs."""

from ..components.doors import hang_door

hang_door(__name__)
