"""What to do after a fit, and with which command: what would make it wrong first, what would better it last."""

from __future__ import annotations

import math

import numpy as np

from upright.identification.model.model import Fit
from upright.identification.model.nuisance_names import SPREADS
from upright.report.fit.figures import autocorrelation
from upright.report.page import Step
from upright.report.symbols import percent, plain

FOLLOWED = 80.0
"""Fit percent below which a free run counts as lost."""


def next_steps(fit: Fit, *, study: str = "STUDY.toml", folder: str = "OUT", crossed: bool = False) -> list[Step]:
    """Steps in order of weight: what would make the model wrong first, what would make it better last.

    `crossed` says that every run was predicted by the others already.
    """
    steps = [*_broken(fit), *_blind(fit), *_nuisances(fit), *_friction(fit, study, folder)]
    tested = crossed or any(s.role == "predict" for s in fit.runs.values())
    if not tested and len(fit.runs) > 1:
        steps.append(
            Step(
                sentence="Every run was fitted, so nothing tests the model yet; predict each from a fit of the others.",
                command=f"upright identify {study} -o {folder} --hold-out each",
            )
        )
    elif not tested:
        steps.append(
            Step(
                sentence="Every run was fitted, so nothing tests the model yet; keep one run or one tail back.",
                command='[[runs]]\nlabel = "tail"\nrole = "predict"',
            )
        )
    steps.append(
        Step(
            sentence="See whether the model predicts a run it has not met: name that run in a study of its own.",
            command=f"upright predict {folder}/fit.json OTHER.toml",
        )
    )
    return steps


def _broken(fit: Fit) -> list[Step]:
    steps: list[Step] = []
    if fit.interrupted:
        steps.append(Step(sentence="The search was stopped; these are its best values so far. Run it to its end."))
    for label, score in fit.runs.items():
        for name, value in score.fit_percent.items():
            if value < 0:
                steps.append(
                    Step(
                        sentence=f"{plain(name)} of run '{label}' is explained worse than by its mean "
                        f"({percent(value)}): look at the sign and scale of the column first; "
                        "a reversed sign scores about −100 %.",
                        command=f"[sensors.{name}]\nsign = -1",
                    )
                )
    lost = [
        label
        for label, s in fit.runs.items()
        if s.role == "fit" and s.horizon is None and any(v < FOLLOWED for v in s.fit_percent.values())
    ]
    if lost:
        steps.append(
            Step(
                sentence=f"The simulation of run {', '.join(map(repr, lost))} loses the measurement. If the figure "
                "shows that it followed at first, end the window there, or restart it from measured states.",
                command='[[runs]]\nhorizon = "0.5 s"',
            )
        )
    stopped = [n for n, e in fit.estimates.items() if e.status == "at bound"]
    none = [n for n in stopped if fit.estimates[n].value == 0]
    if none:
        steps.append(Step(sentence=f"These runs need no {', '.join(none)}: the estimate ended at zero; leave it out."))
    for name in stopped:
        if name not in none:
            steps.append(Step(sentence=f"{name} stopped at its bound; widen the bound or give its value as known."))
    return steps


def _blind(fit: Fit) -> list[Step]:
    steps = [Step(sentence=sentence) for sentence in fit.unseen]
    weak = [n for n, e in fit.estimates.items() if e.status in ("weak", "unseen")]
    if weak and not fit.unseen:
        steps.append(
            Step(
                sentence=f"The data hardly see {', '.join(weak)}: measure one of them on the bench and give it "
                "as known, or add a run that moves it more.",
                command=f'{weak[0]} = {{ value = "…", uncertainty = "…" }}',
            )
        )
    return steps


def _nuisances(fit: Fit) -> list[Step]:
    """What differs from run to run: useless factors, and predictions that chose their own."""
    steps: list[Step] = []
    idle = [
        f"{name} of {kind}{label}"
        for kind, homes in (("group ", fit.groups), ("", fit.per_run))
        for label, own in homes.items()
        for name, e in own.items()
        if e.status == "unseen"
    ]
    if idle:
        steps.append(Step(sentence=f"The runs say nothing about {', '.join(idle)}: leave it out of unknown or shared."))
    fitted_to = {
        label: [n for n in score.adapted if n.partition(".")[0] in SPREADS]
        for label, score in fit.runs.items()
        if score.role != "fit"
    }
    label = next((label for label, names in fitted_to.items() if names), None)
    if label is not None:
        names = " and ".join(fitted_to[label])
        steps.append(
            Step(
                sentence=f"The prediction of run '{label}' chose its own {names}, so it proves less; "
                "let the run share that with runs that are fitted.",
                command=f'[[runs]]\nlabel = "{label}"\nshared = {{ {fitted_to[label][0]} = "that day" }}',
            )
        )
    return steps


def _friction(fit: Fit, study: str, folder: str) -> list[Step]:
    """Residuals that remember themselves: is there a friction term that was left out?"""
    coloured: list[str] = []
    for label, score in fit.runs.items():
        for j, name in enumerate(score.measured):
            rest = score.y[:, j] - score.simulated[:, j]
            rest = rest[np.isfinite(rest)]
            lags = max(1, rest.size // 10)
            if rest.size < 20 or score.role != "fit":
                continue
            r = autocorrelation(rest, lags)[1:]
            if np.mean(np.abs(r) > 1.96 / math.sqrt(rest.size)) > 0.3:
                coloured.append(f"{plain(name)} of '{label}'")
    fixed = [
        f"{term} of {joint.on} ({name})"
        for joint in fit.rig.plant.joints
        for term, name in (("Coulomb friction", joint.coulomb), ("quadratic drag", joint.quadratic))
        if name and name not in fit.rig.estimated
    ]
    if not coloured or not fixed:
        return []
    names = [f.rpartition("(")[2].rstrip(")") for f in fixed]
    return [
        Step(
            sentence=f"What is left over is not noise ({', '.join(coloured[:3])}"
            f"{' and others' if coloured[3:] else ''}). Not estimated so far: {'; '.join(fixed)}. "
            "Give them guesses; the ladder keeps those with which held-out data are predicted better.",
            command=f'[parameters]\n{names[0]} = {{ guess = "…", min = 0 }}\n\nupright ladder {study} -o {folder}',
        )
    ]
