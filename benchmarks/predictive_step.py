"""What one sample of `DistributedMpc` costs, median and worst: the work is the same whatever happens.

    python benchmarks/predictive_step.py

The native FMU, 2000 samples through raw calls, each behind a train drawn anew: near, far, lost, braking. CPU
time of doStep and get.
"""

import statistics
import time

import numpy as np
from fmu_step import STEP, Stepper
from railcosim.fmus.build import build
from railcosim.orchestrator.fmi.archive import Workspace

SAMPLES = 2000


def main() -> None:
    rng = np.random.default_rng(1)
    costs = []
    with Workspace() as workspace:
        stepper = Stepper(build("DistributedMpc", kind="native"), workspace)
        flags = stepper.slave.channel("Boolean", ["has_ahead", "has_plan"])
        known = stepper.slave.channel("Real", ["speed", "target_speed", "ahead_position", "ahead_speed", "ahead_age"])
        for k in range(SAMPLES):
            flags.set([bool(rng.random() < 0.8), bool(rng.random() < 0.5)])
            known.set(rng.uniform([0.0, 0.0, 200.0, 0.0, 0.0], [80.0, 80.0, 3000.0, 80.0, 5.0]).tolist())
            begin = time.thread_time()
            stepper.slave.step(k * STEP, STEP)
            stepper.get.get()
            costs.append(1e6 * (time.thread_time() - begin))
        stepper.slave.free()
    centile = sorted(costs)[-SAMPLES // 100]
    print(f"{SAMPLES} samples: median {statistics.median(costs):.0f} us, 99 % {centile:.0f}, worst {max(costs):.0f} us")


if __name__ == "__main__":
    main()
