"""Pictures of recorded signals, as a scenario's `[[figures]]` ask for them; and the style of every other picture."""

from ...components.doors import hang_door

hang_door(__name__)
