"""Many runs of one system: batches, studies, the search for what breaks a requirement."""

from ...components.doors import hang_door

hang_door(__name__)
