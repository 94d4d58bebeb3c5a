"""The controller that ``orchestrate new`` writes: commented, and it runs."""

from __future__ import annotations

import keyword
import re
from pathlib import Path

from .errors import ScenarioError

_TEXT = '''"""A cruise controller of one's own: written once here, it runs as plain Python, in a test, and as an FMU.

Try it in a published scenario:   orchestrate run comfort_cruise --swap cruise={file}:{name}
See its interface:                orchestrate describe {file}:{name}
Keep it as an FMU:                orchestrate build {file}:{name} -o .
"""

from railcosim.components import CruiseController, Parameter
from railcosim.components.maths import clip, where


class {name}(CruiseController):
    """Keeps the target speed and half the speed difference to the train ahead."""

    # What can be set from outside: unit, value, what it is. Inputs and outputs come with CruiseController.
    gain = Parameter("1/s", 0.03, minimum=0.0, description="gain on the error to the target speed")
    limit = Parameter("m/s2", 0.8, minimum=0.0, description="largest acceleration asked for")

    def outputs(self):
        # Values are attributes; use operators and railcosim.components.maths, no if/and/or on values.
        demand = self.gain * (self.target_speed - self.speed)
        demand = demand + where(self.has_ahead, 0.5 * self.gain * (self.ahead_speed - self.speed), 0.0)
        demand = clip(demand, -self.limit, self.limit)
        return {{
            "demand": demand,
            "force": self.mass * (self._davis(self.speed) + self.line_resistance + demand),
            "range_violated": False,
        }}
'''


def write_skeleton(path: Path) -> str:
    """Write a new controller file and return the name of its class.

    Raises:
        ScenarioError: the file exists, or its name does not make a class name.
    """
    if path.suffix != ".py":
        raise ScenarioError(f"{path}: a component is a Python file; give a name that ends in .py")
    name = "".join(word.capitalize() for word in re.split(r"[^0-9A-Za-z]+", path.stem) if word)
    if not name.isidentifier() or keyword.iskeyword(name):
        raise ScenarioError(f"{path}: {path.stem!r} does not make a class name; begin it with a letter")
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(_TEXT.format(file=path.name, name=name))
    except FileExistsError:
        raise ScenarioError(f"{path} exists already; choose another name") from None
    except OSError as error:
        raise ScenarioError(f"{path} cannot be written: {error.strerror or error}") from error
    return name
