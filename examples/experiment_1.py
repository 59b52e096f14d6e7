"""Experiment 1 from Python: weigh the disk of a Furuta pendulum, sweep the hanging rig, know how fast it will fall.

    python examples/experiment_1.py 1

The number is the seed: which rig of the make, 0 when left out. The picture of the weighing goes to experiment_1a.png,
the Bode plot of the pendulum to experiment_1b.svg.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from upright.experiments.frequency_1b.figures import bode_charts
from upright.experiments.frequency_1b.run import run_frequency
from upright.experiments.stand.twin import TwinStand
from upright.experiments.weighing_1a.figures import line_figure
from upright.experiments.weighing_1a.run import run_weighing
from upright.identification.frequency.answer import curves
from upright.report.drawing import save
from upright.rig.makes import make_rig

seed = int(sys.argv[1]) if sys.argv[1:] else 0
rig = make_rig("furuta", seed)

with TemporaryDirectory() as folder:
    weighed = run_weighing(TwinStand(rig=rig), seed, Path(folder))
    swept = run_frequency("furuta", seed, Path(folder), weighed=weighed.known)

line = weighed.campaign.loadings
print(f"(a) {line.verdict}")
for known in weighed.known:
    print(f"    {known.name} = {known.value:.4g} ± {known.stderr:.2g}, truth {getattr(rig.plant, known.name):.4g}")

answer, truth = swept.answer, swept.truth
print(f"(b) {answer.fit.verdict}")
for name, found in answer.fit.estimates.items():
    low, high = found.interval
    print(f"    {name:15}{found.value:9.3g}  ({low:.3g} to {high:.3g} {found.unit}), truth {truth[name]:.3g}")
pole = rig.plant.linear("inverted").poles()[0].real
print(f"    The pole by the simplex on dB: {answer.simplex_pole.real:.3f} 1/s; truth {pole:.3f} 1/s")

*_, bode = bode_charts(answer.data, answer, fine=curves(answer))
print("Pictures:", save(line_figure(line, "kg m^2"), Path("experiment_1a.png")), bode.save(Path("experiment_1b.svg")))
