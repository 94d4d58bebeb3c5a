"""Draws ``icon.png``, the ``model.png`` of every FMU. Run by hand when the icon shall change; a build only copies it.

python fmus/resources/draw_icon.py
"""

from pathlib import Path

import matplotlib as mpl
from matplotlib.patches import Circle, FancyBboxPatch

mpl.use("Agg")
from matplotlib import pyplot as plt

INK, BODY, GLASS = "#20303c", "#2f7fb8", "#dff1fb"

figure = plt.figure(figsize=(1.28, 1.28), dpi=100)
axes = figure.add_axes((0, 0, 1, 1), xlim=(0, 16), ylim=(0, 16), aspect="equal")
axes.axis("off")
axes.plot([0.5, 15.5], [2.2, 2.2], color=INK, linewidth=2.5, solid_capstyle="round")
axes.add_patch(FancyBboxPatch((2, 4.2), 12, 7.6, boxstyle="round,pad=0,rounding_size=2", facecolor=BODY, edgecolor=INK))
for left in (3.2, 7.0, 10.8):
    axes.add_patch(
        FancyBboxPatch((left, 7.6), 2.2, 2.6, boxstyle="round,pad=0,rounding_size=0.4", facecolor=GLASS, lw=0)
    )
for x in (4.4, 7.0, 9.6, 12.2):
    axes.add_patch(Circle((x - 0.3, 3.4), 1.0, facecolor=INK))
figure.savefig(Path(__file__).with_name("icon.png"), transparent=True, metadata={"Software": None})
