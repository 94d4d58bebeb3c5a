"""``orchestrate``: the command line."""

from ...components.doors import hang_door

hang_door(__name__)
