"""Trains at virtual-coupling distances on a bad radio, whose first one makes an emergency stop: random cases by seed.

Five trains run at 60 m/s, 400 m apart (front to front, 200 m long). Some 20 s after the start the first one brakes with
0.8 m/s2 to a stand. The radio loses up to 20 %, is up to 0.5 s late, and is out for up to 2 s around the braking.
"""

import numpy as np
from railcosim.orchestrator.system import System

TRAINS, SPEED, BRAKING, LENGTH, GAP = 5, 60.0, 0.8, 200.0, 400.0


def close_system(seed, *, fallback=True, guard=True):
    """One case; outage, losses and delay are drawn with the seed."""
    rng = np.random.default_rng(seed)
    outage, loss, delay, lead, moment = rng.uniform([0.0, 0.0, 0.0, 0.0, 19.0], [2.0, 0.2, 0.5, 2.0, 21.0])
    law = {"rho": 1.0, "k": 0.009, "alpha": 0.02, "pull_limit": 0.5, "gap_width": 140.0, "gap_tolerance": 0.0}
    law |= {"gap_base": GAP - 2.5 * SPEED, "gap_time": 2.5, "gap_braking": 1e9, "acceleration_limit": BRAKING}
    safety = {
        "fallback": fallback,
        "guard": guard,
        "braking": BRAKING,
        "ahead_braking": BRAKING,
        "standstill_gap": 250.0,
    }
    system = System(stop_time=150.0, step=0.1, seed=seed)
    for i in range(1, TRAINS + 1):
        system.add(f"train[{i}]", "PointMassTrain", position=20e3 - GAP * (i - 1), speed=SPEED)
        own = {"has_ahead": i > 1, "has_behind": 1 < i < TRAINS, **(law if i > 1 else {"k": 10.0})}
        system.add(f"cruise[{i}]", "TunablePotentialCruise", **safety, **(law | own))
        for name in ("position", "speed"):
            system.connect(f"train[{i}].{name}", f"cruise[{i}].{name}")
        system.connect("target.value" if i > 1 else "stop.value", f"cruise[{i}].target_speed")
        system.connect(f"cruise[{i}].force", f"train[{i}].force")
    system.add("target", "Schedule", values=SPEED)
    system.add("stop", "Schedule", {"points": 2}, times=[0.0, float(moment)], values=[SPEED, 0.0])
    begin = float(moment - lead)
    build = {"messages": 12}
    channel = {
        "outage_begin": begin,
        "outage_end": begin + float(outage),
        "refresh": 0.1,
        "delay": float(delay),
        "jitter": 0.1,
        "loss": float(loss),
    }
    channel |= {"burst_begin": 0.02, "burst_end": 0.3}
    for i in range(1, TRAINS):
        for link, sender, receiver, side in (("radio", i, i + 1, "ahead"), ("radio_back", i + 1, i, "behind")):
            system.add(f"{link}[{i}]", "RadioLink", build, **channel)
            for name in ("position", "speed"):
                system.connect(f"train[{sender}].{name}", f"{link}[{i}].sent_{name}")
            for name in ("position", "speed", "age"):
                system.connect(f"{link}[{i}].{name}", f"cruise[{receiver}].{side}_{name}")
    return system


def braking_margin(result):
    """Smallest gap less the train's length and the distance to stop behind a train that brakes as hard as it can, m."""
    x, v = (np.array([result[f"train[{i}].{name}"] for i in range(1, TRAINS + 1)]) for name in ("position", "speed"))
    stop = np.maximum(v, 0.0) ** 2 / (2.0 * BRAKING)
    return float((x[:-1] - x[1:] - LENGTH - stop[1:] + stop[:-1]).min())
