"""A short hop of a light train, which is solved at once."""

import pytest
from railcosim.orchestrator.driving import load_case

HOP = """
title = "A short hop"
[drive]
time = 190.0
intervals = 12
tolerance = 0.01
[drive.line]
sections = [{ position = 0.0 }, { position = 800.0, gradient = 0.01 }, { position = 1500.0, gradient = -0.01 }]
speed_limits = [[0.0, 25.0], [1000.0, 16.0], [1400.0, 25.0]]
stops = [{ position = 0.0 }, { position = 2500.0 }]
neutral_sections = [[400.0, 460.0]]
[drive.train]
mass = 120e3
rotating_mass = 0.1
length = 60.0
max_speed = 22.0
resistance = { a = 2400.0, b = 60.0, c = 6.0 }
traction = { force = 100e3, power = 1.2e6, efficiency = 0.9 }
regenerative_brake = { force = 60e3, power = 1.2e6, efficiency = 0.8 }
friction_brake = 60e3
max_acceleration = 0.7
max_deceleration = 0.6
"""


@pytest.fixture
def hop(tmp_path):
    """Makes the hop's case, changed: by texts as `--set` takes them, or in its file."""

    def make(*settings, text=HOP, **changes):
        (tmp_path / "hop.toml").write_text(text)
        return load_case(tmp_path / "hop.toml", settings, changes)

    return make
