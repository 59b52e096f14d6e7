"""How does the picture of the README come about? Fit a study and draw one of its runs.

    python examples/readme_picture.py examples/studies/kawata_crane.toml --data DATA --run "kP 10" -o picture.svg

The data are public; each study names its source. DATA is the folder they were unpacked to.
"""

import argparse
from pathlib import Path

from upright.identification.estimate import identify
from upright.report.drawing import save
from upright.report.fit.figures import fit_figure
from upright.study.load import load_study

ask = argparse.ArgumentParser(description=__doc__.splitlines()[0])
ask.add_argument("study", type=Path)
ask.add_argument("--data", type=Path, help="folder of the runs' files; the study's own when left out")
ask.add_argument("--run", help="label of the run to draw; the first when left out")
ask.add_argument("-o", "--out", type=Path, default=Path("picture.svg"), help="SVG or PNG")
ask.add_argument("--title", help="heading; the study's own when left out")
asked = ask.parse_args()

study = load_study(asked.study, data=asked.data)
fit = identify(study.model, study.runs)
label = asked.run or next(iter(fit.runs))
score = fit.runs[label]
what = "fitted" if score.role == "fit" else "predicted, not fitted"
drawing = fit_figure(
    score, study.model.plant, title=f"{asked.title or study.title}, run {label}, {what}", width=7.0, height=1.75
)
print(fit.verdict)
print(save(drawing, asked.out))
