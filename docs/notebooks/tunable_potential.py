# %% [markdown]
# # A tunable potential, as a notebook
#
# Five trains follow a speed that goes from 70 to 65 and back to 70 m/s, and keep a gap that depends on it. Huang et al.
# (2022) pull neighbours together with a potential whose shape can be tuned. The formulas of the available text are
# lost; what runs here is a reconstruction, calibrated to the paper's Table 4, and says so. More is on
# [the scenario's own page](../models/tunable_potential.md).

# %%
from railcosim.orchestrator import load, run
from railcosim.orchestrator.comparison import compare

outcome = run(load("tunable_potential"))
outcome

# %%
# Speeds of the five trains and the speed they are to have
speeds = outcome.plot("train[:].speed", "target.value")

# %% [markdown]
# From 65 to 70 m/s the trains move apart again: the gap that they want grows with the speed.

# %%
# Gaps between neighbours
gaps = outcome.plot("train[i-1].position - train[i].position")

# %% [markdown]
# The signals as a frame of pandas, with their units:

# %%
frame = outcome.frame()[["train[1].speed", "train[2].speed", "train[2].position"]]
print(frame.attrs["units"]["train[2].position"])
frame.iloc[::2000]

# %% [markdown]
# The comfortable preset, side by side with the calibrated one; in each row the better value is bold.

# %%
presets = ("table-4", "tunable-comfort")
compare({name: load("tunable_potential", preset=name) for name in presets})
