"""The line of the subway trains, where no other is given."""

MILD = (
    {"position": -200.0, "gradient": 0.002, "radius": 1480.0, "tunnel": 1500.0},
    {"position": 13.0, "gradient": -0.003, "tunnel": 1500.0},
    {"position": 300.0, "gradient": -0.001, "radius": 800.0, "tunnel": 1500.0},
    {"position": 800.0, "gradient": 0.001, "tunnel": 1500.0},
    {"position": 1300.0, "gradient": 0.0015, "tunnel": 1500.0},
    {"position": 1500.0, "gradient": 0.0005, "radius": 1000.0},
    {"position": 2000.0, "gradient": -0.0015},
    {"position": 2600.0, "gradient": -0.002, "radius": 600.0, "tunnel": 1000.0},
    {"position": 3100.0, "gradient": 0.0015, "tunnel": 1000.0},
)
"""A stand-in for Fig. 2 of Liu & Hou 2020, which is not available: its 7.36 kN at departure give the printed maxima.

The first section reaches back behind the station, so that the standing train is on it.
"""
