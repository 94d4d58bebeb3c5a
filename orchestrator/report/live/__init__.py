"""Live models in a page: the FMUs of a run as WebAssembly, and a plan by which the page steps them as the run did.

`plan` writes down what the master of the run would do; ``resources/master.js`` does it. `controls` says what can be
changed, `tracks` what curves are made of, and `making` puts it together from a run's record.
"""

from ....components.doors import hang_door

hang_door(__name__)
