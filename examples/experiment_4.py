"""Experiment 4 from Python: let a Furuta pendulum swing, find its numbers, follow its disk.

    python examples/experiment_4.py 1

The number is the seed: which rig of the make, 0 when left out. The picture goes to experiment_4.png.
"""

import math
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from upright.experiments.free_swing_4.release import drift_paths, freed
from upright.experiments.free_swing_4.run import fit_question, recovered, write_questions
from upright.physics import Furuta
from upright.report.drawing import save
from upright.report.fit.figures import fit_figure
from upright.rig.makes import make_rig

# A rig of the make with its drive belt off, so that the disk turns freely.
rig = freed(make_rig("furuta", seed=int(sys.argv[1]) if sys.argv[1:] else 0))

# Six releases are logged as the encoders count them; each question is a study that `upright identify` takes too.
with TemporaryDirectory() as folder:
    asked = {question.name: (question, study) for question, study in write_questions(rig, Path(folder))}
    swing = fit_question(*asked["free_swing"]).fit
    blind = fit_question(*asked["no_scale"]).fit

print("Numbers of the rig, from guesses 30 % off:")
for found in recovered(rig, swing):
    low, high = found.interval
    print(f"  {found.name:5}{found.value:10.3g}  ({low:.3g} to {high:.3g} {found.unit}), truth {found.truth:.3g}")

fitted, predicted = swing.runs.values()
print(f"Explained: {min(fitted.fit_percent.values()):.2f} % of the release it was fitted to,")
print(f"{min(predicted.fit_percent.values()):.2f} % of one it has not seen.")
print(f"Without a known inertia: {'; '.join(blind.unseen)}")

print("Where the disk is after 24 s, from where it started:")
for path in drift_paths(rig):
    print(f"  {path.name:38}{math.degrees(path.end):6.1f}°")

pole = rig.plant.linear("inverted").poles()[0].real
model = rig.plant.replace(**{n: e.value for n, e in swing.estimates.items() if n in rig.plant.names()})
print(f"The pole to be held upright: {model.linear('inverted').poles()[0].real:.3f} 1/s, truth {pole:.3f} 1/s")
print("Picture:", save(fit_figure(fitted, Furuta, title="Released from horizontal"), Path("experiment_4.png")))
