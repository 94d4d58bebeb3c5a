"""What a run finds without being asked, at every communication point: collisions, reversing, refusals, divergence."""

from ....components.doors import hang_door

hang_door(__name__)
