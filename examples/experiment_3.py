"""Experiment 3 from Python: steer the far end of a flexible shaft by state feedback and by PD.

    python examples/experiment_3.py 1

The number is the seed: which rig of the make, 0 when left out. The picture goes to experiment_3.png.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from upright.experiments.tracking_3.figures import steps_figure
from upright.experiments.tracking_3.run import run_tracking
from upright.report.drawing import save

seed = int(sys.argv[1]) if sys.argv[1:] else 0

# Pulses, a fit, gains for the poles of Table 2, a step as large as the drive allows, and a PD searched for comparison.
with TemporaryDirectory() as folder:
    done = run_tracking("rectilinear", seed, Path(folder))

print(f"Poles of the fitted rig: {', '.join(f'{p:.2f}' for p in done.model.linear('rest').poles())} 1/s")
print(f"Step of {1e3 * done.step.size:g} mm, {done.step.reason}.")

for outcome in (*done.sets, done.summed, done.pd, done.stiff, done.far):
    law, run = outcome.law, outcome.measured
    gains = ", ".join(f"{k:.4g}" for k in law.K)
    print(f"{law.name}: K = [{gains}], k_pf = {law.k_pf:.4g} V/m")
    if run.figures is None:
        print(f"  leaves the rail {run.tripped:.2f} s after the start")
        continue
    print(f"  rise {1e3 * run.figures.rise:.0f} ms, overshoot {100 * run.figures.overshoot:.0f} %,", end=" ")
    print(f"at the reference after {1e3 * run.figures.arrival:.0f} ms, {run.effort.peak:.2f} V at most", end=" ")
    print(f"(foreseen {outcome.predicted.effort.peak:.2f} V), a push moves it {1e3 * run.give:.1f} mm")

shown = [done.sets[0], done.sets[-1], done.pd, done.stiff]
print("Picture:", save(steps_figure(done, shown), Path("experiment_3.png")))
