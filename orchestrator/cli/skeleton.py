"""The controller that ``orchestrate new`` writes: commented, and it runs."""

from __future__ import annotations

import keyword
from pathlib import Path

from ...components import CATALOGUE
from .. import world
from ..errors import ScenarioError

_TEXT = '''"""A cruise controller of one's own: written once here, it runs as plain Python, in a test, and as an FMU.

Try it in a published scenario:   orchestrate run comfort_cruise --swap cruise={file}:{name}
See its interface:                orchestrate describe {file}:{name}
Keep it as an FMU:                orchestrate build {file}:{name} -o .
"""

from railcosim.components import CruiseController, Output, Parameter
from railcosim.components.maths import clip, where


class {name}(CruiseController):
    """Keeps the target speed, and half as firmly the speed of the train ahead."""

    # What can be set from outside: unit, value, what it is.
    gain = Parameter("1/s", 0.03, minimum=0.0, description="gain on the error to the target speed")
    acceleration_limit = Parameter("m/s2", 0.8, minimum=0.0, description="largest acceleration asked for")

    # Inputs (position, speed, ahead_speed, ...) and outputs (demand, force, range_violated) come with CruiseController;
    # this one is added, because the metrics of the published scenarios look at it.
    bottom_demand = Output("m/s2", description="demand before the limit")

    def outputs(self):
        # Values are attributes. Use operators and railcosim.components.maths on them: no if, and, or, math.
        bottom = self.gain * (self.target_speed - self.speed)
        bottom = bottom + where(self.has_ahead, 0.5 * self.gain * (self.ahead_speed - self.speed), 0.0)
        demand = clip(bottom, -self.acceleration_limit, self.acceleration_limit)
        return {{
            "demand": demand,
            "force": self.mass * (self._resistance(self.speed) + demand),
            "range_violated": False,
            "bottom_demand": bottom,
        }}
'''


_TAKEN = ("CruiseController", "Output", "Parameter", *CATALOGUE)
"""What the file imports, and what a swap by bare name would mean."""


def write_skeleton(path: Path) -> str:
    """Write a new controller file and return the name of its class.

    Raises:
        ScenarioError: the file exists, or its name makes no module or class of one's own.
    """
    if path.suffix != ".py":
        raise ScenarioError(f"{path}: a component is a Python file; give a name that ends in .py")
    if not (path.stem.isidentifier() and path.stem.isascii()) or keyword.iskeyword(path.stem):
        raise ScenarioError(
            f"{path}: an FMU carries the file as a Python module; name it with letters, digits and _ only, not with a "
            "digit first, such as my_controller.py"
        )
    name = "".join(word[0].upper() + word[1:] for word in path.stem.split("_") if word)
    if not name.isidentifier() or name in _TAKEN or keyword.iskeyword(name):
        raise ScenarioError(f"{path}: {name or path.stem!r} cannot name a class of yours; choose another file name")
    try:
        with world.open(path, "x", encoding="utf-8") as stream:
            stream.write(_TEXT.format(file=path.name, name=name))
    except FileExistsError:
        raise ScenarioError(f"{path} exists already; choose another name") from None
    except OSError as error:
        raise ScenarioError(f"{path} cannot be written: {error.strerror or error}") from error
    return name
