# %% [markdown]
# # A metro train that learns, as a notebook
#
# The same train makes the same trip of 190 s ten times. For every instant it keeps an estimate of what holds it back,
# and each trip makes the estimate better: iterative learning control after Liu and Hou (2020), with a barrier that is
# to keep the speed below its limit. More is on [the scenario's own page](../models/cailc_ato.md).

# %%
from matplotlib import pyplot
from railcosim.orchestrator import load, run

outcome = run(load("cailc"))
outcome.status, len(outcome), len(outcome.time)

# %% [markdown]
# What is learnt shows in the largest error of each trip, which falls by orders of magnitude.

# %%
# Largest error of the speed and of the position on each trip
finished = outcome["monitor.finished_trip"]
trips = [trip for trip in range(1, 11) if trip in finished]
figure, axes = pyplot.subplots()
for quantity, unit in (("speed", "m/s"), ("position", "m")):
    errors = [outcome[f"monitor.finished_{quantity}_error"][finished == trip][0] for trip in trips]
    axes.semilogy(trips, errors, "o-", label=f"{quantity} [{unit}]")
axes.set_xlabel("trip")
axes.set_ylabel("largest error")
_ = axes.legend()

# %% [markdown]
# The last trip, with the profile that it follows and the limit that it may not reach:

# %%
# Speed on the last trip
last = outcome.plot("train.speed", "timetable.reference_speed", "timetable.speed_limit")
end = outcome.time[-1]
_ = last.set_xlim(end - 200.0, end)
# %% [markdown]
# What was required, and by how much it holds or fails:

# %%
[(verdict.name, verdict.verdict, verdict.margin) for verdict in outcome.requirements]
