"""One FMU of any version of the standard behind one face.

An archive is unpacked (`archive`), its description read into an `Interface` (`reader`, with `repair` for what tools get
wrong and `translation` for other versions), and what can be instantiated is a `Model` (`models`). An instance is a
`Slave`, whatever it is made of: an FMU in this process (`binding`), one in another (the room `isolation`), or a
component as Python objects (`plain`).
"""

from ...components.doors import hang_door

hang_door(__name__)
