"""What the compiled step loop is given: the operations of an algorithm on a system, as flat arrays."""

from ....components.doors import hang_door

hang_door(__name__)
