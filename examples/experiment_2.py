"""Experiment 2 from Python: identify a Furuta pendulum hanging, hold it upright, swing it up.

    python examples/experiment_2.py 1

The number is the seed: which rig of the make, 0 when left out. The picture goes to experiment_2.png.
"""

import math
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from upright.control import design_swing_up
from upright.control.swing_up import ascent_of
from upright.control.trial import trial
from upright.experiments.frequency_1b.run import run_frequency
from upright.experiments.regulation_2.run import run_regulation
from upright.experiments.stand.twin import TwinStand
from upright.report.drawing import CYCLE, figure, save, styled
from upright.rig.completion import completed
from upright.rig.makes import make_rig
from upright.study.stored_rig import read_stored_rig

seed = int(sys.argv[1]) if sys.argv[1:] else 0
rig = make_rig("furuta", seed)

# Hanging, the rig is swept with sines; gains and verdicts come from that fit alone, the rig is asked only afterwards.
with TemporaryDirectory() as folder:
    print(run_frequency("furuta", seed, Path(folder)).answer.fit.verdict)
    identified = completed(read_stored_rig(Path(folder) / "fit.json", seed=seed))
    done = run_regulation(identified, TwinStand(rig=rig), seed, Path(folder))

for a in done.attempts:
    gains = ", ".join(f"{k:.3g}" for k in a.placement.K[0])
    tilt, share = math.degrees(a.before.tilt), 100 * a.before.words[a.before.word]
    print(f"{a.name}: K = [{gains}] V/rad and V s/rad, bears a tilt of {tilt:.0f}°;")
    print(f"  said beforehand: {a.before.word} ({share:.0f} %), came: {a.word}, {a.score.effort_peak:.1f} V at most")
print(f"To recommend: {done.best.name}.")

law = design_swing_up(identified)
hanging, inverted = rig.plant.state("hanging"), rig.plant.state("inverted")
rule, start = law.rule(rig, hanging), hanging - inverted
ascent = ascent_of(trial(rig, rule, at="inverted", start=start, seconds=6), law, rule)
print(f"From hanging: {ascent.swings} half swings, upright from {ascent.up:.2f} s on, {ascent.peak:.1f} V at most.")


@styled
def picture():
    drawing = figure(3.6)
    panels = drawing.subplots(2, 1, sharex=True)
    for a, (colour, line) in zip(done.attempts, CYCLE, strict=False):
        for axes, angle in zip(panels, np.degrees(a.after.deviation.T), strict=True):
            axes.plot(a.after.t, angle, color=colour, linestyle=line, label=a.name)
    panels[0].set_ylabel("arm [°]")
    panels[1].set(ylabel="rod from upright [°]", xlabel="time [s]", xlim=(0, 2.5))
    panels[0].legend(ncols=4)
    return drawing


print("Picture:", save(picture(), Path("experiment_2.png")))
