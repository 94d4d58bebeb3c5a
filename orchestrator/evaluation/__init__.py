"""What recorded signals mean: expressions, metrics, requirements, reference values."""

from ...components.doors import hang_door

hang_door(__name__)
