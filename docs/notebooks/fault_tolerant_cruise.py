# %% [markdown]
# # Actuators that fail, as a notebook
#
# Three trains of three carriages each, whose actuators lose force while they run. An observer estimates fault and
# state of every carriage from noisy measurements, and the controller makes up for what is lost, with a barrier on
# distances and speed differences. The numbers of the paper's figures are reconstructed; more is on
# [the scenario's own page](../models/fault_tolerant_cruise.md).

# %%
from railcosim.orchestrator import load, run

outcome = run(load("fault_tolerant_cruise"))
outcome

# %% [markdown]
# The fault of the first actuator of train 2, and what the observer makes of it:

# %%
# A fault and its estimate
fault = outcome.plot("faults[2].fault_now[1]", "cruise[2].fault_estimate[1]")

# %% [markdown]
# The distances between the trains stay in their range all the same.

# %%
# Distances between neighbouring trains
distances = outcome.plot("train[i-1].tail_position - train[i].position[1]")

# %% [markdown]
# Every requirement has a margin; the smallest tells where the law comes nearest to its limits.

# %%
nearest = min((v for v in outcome.requirements if v.margin is not None), key=lambda v: v.margin)
nearest.name, nearest.margin, nearest.time
