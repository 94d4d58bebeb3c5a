"""The curves of ETCS supervision for the FLIRT, as a picture: `python benchmarks/etcs_curves.py PICTURE`."""

import sys

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from railcosim.components.environment.track import read_line
from railcosim.components.supervision.etcs_limits import Reaction, emergency_limits, service_limits, speed_uncertainty
from railcosim.components.supervision.etcs_targets import read_train, supervised
from railcosim.components.trains.etcs_brakes import FLIRT

KMH = 3.6
LINE = {
    "sections": [{"position": 0.0}, {"position": 1500.0, "gradient": -0.012}, {"position": 3000.0, "gradient": 0.004}],
    "speed_limits": [[0.0, 140.0 / KMH], [3000.0, 80.0 / KMH]],
}
END, OVERLAP = 5000.0, 80.0
COLOURS = {"EBI": "#b2182b", "SBI": "#ef8a62", "W": "#fdae61", "P": "#1a9850", "I": "#4575b4"}


def main(path: str) -> None:
    """Draw the limits before a fall of the speed limit and before an end of authority."""
    mpl.use("Agg")
    known = supervised(read_line(LINE), read_train(FLIRT))
    target = known.targets[0]
    through = known.emergency.rising(END + OVERLAP, 0.0)
    stop = known.service.rising(END, 0.0)
    found: dict[str, list[list[tuple[float, float]]]] = {name: [[], []] for name in COLOURS}
    curves: list[list[tuple[float, float]]] = [[], [], []]
    for v in np.linspace(0.0, 140.0 / KMH, 300):
        reaction = Reaction(v, speed_uncertainty(v), 0.0, 0.0, known.emergency_times[0], known.service_times[0])
        fall = emergency_limits(target.curve, target.speed, target.location, reaction)
        end = [min(a, b) for a, b in zip(service_limits(stop, reaction), emergency_limits(through, 0.0, 1e9, reaction),
                                         strict=True)]  # fmt: skip
        for name, a, b in zip(COLOURS, fall, end, strict=True):
            if v > target.speed:
                found[name][0].append((a, v))
            if b > target.location:
                found[name][1].append((b, v))
        for k, curve in enumerate((target.curve, through, stop)):
            place = curve.location(v)
            if v >= curve.foot_speed and place > 500.0 and not (k and place < target.location):
                curves[k].append((place, v))
    figure, axes = plt.subplots(figsize=(10.0, 5.0), layout="constrained")
    limits = LINE["speed_limits"]
    axes.step([0.0, 3000.0, END], [limits[0][1] * KMH, limits[1][1] * KMH, limits[1][1] * KMH], where="post", color="k",
              label="speed limit")  # fmt: skip
    for name, lines in found.items():
        for k, line in enumerate(lines):
            x, v = zip(*line, strict=True)
            axes.plot(x, np.array(v) * KMH, color=COLOURS[name], label=name if k == 0 else None)
    for k, (curve, style) in enumerate(zip(curves, ("--", "--", ":"), strict=True)):
        x, v = zip(*curve, strict=True)
        axes.plot(x, np.array(v) * KMH, style, color="0.4", label=(("EBD", None, "SBD")[k]))
    for place, name in ((END, "EoA"), (END + OVERLAP, "SvL")):
        axes.axvline(place, color="0.7", lw=0.8)
        axes.annotate(name, (place, 150.0), ha="right" if name == "EoA" else "left")
    axes.set(xlabel="position [m]", ylabel="speed [km/h]", xlim=(1000.0, 5200.0), ylim=(0.0, 160.0))
    axes.legend(loc="lower left", ncols=2)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main(sys.argv[1])
