"""How time advances: initialization, then communication steps by one of the `algorithms`.

`loop` is the loop over communication points, `exchange` the values between instances; `events`, `extrapolation` and
`algebraic` loops are what may happen at a point, in a step and within an instant. `compiled` hands steps to the C
kernel.
"""

from ...components.doors import hang_door

hang_door(__name__)
