"""A whole scenario for other tools: as one FMU, or as FMUs and their structure."""

from ...components.doors import hang_door

hang_door(__name__)
