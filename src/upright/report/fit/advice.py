"""What to do after a fit, and with which command: what would make it wrong first, what would better it last."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from upright.identification.model.fit import Fit
from upright.identification.model.runs import SPREADS
from upright.report.fit.figures import autocorrelation
from upright.report.page import Step
from upright.report.symbols import percent, plain

FOLLOWED = 80.0
"""Fit percent below which a free run counts as lost."""


def next_steps(fit: Fit, *, study: str = "STUDY.toml", folder: str = "OUT", crossed: bool = False) -> Iterator[Step]:
    """Steps in order of weight: what would make the model wrong first, what would make it better last.

    `crossed` says that every run was predicted by the others already.
    """
    yield from (*_broken(fit), *_blind(fit), *_nuisances(fit), *_friction(fit, study, folder))
    untested = "Every run was fitted, so nothing tests the model yet; "
    if not crossed and all(s.role == "fit" for s in fit.runs.values()):
        if len(fit.runs) > 1:
            each = f"upright identify {study} -o {folder} --hold-out each"
            yield Step(f"{untested}predict each from a fit of the others.", each)
        else:
            yield Step(f"{untested}keep one run or one tail back.", '[[runs]]\nlabel = "tail"\nrole = "predict"')
    yield Step(
        "See whether the model predicts a run it has not met: name that run in a study of its own.",
        f"upright predict {folder}/fit.json OTHER.toml",
    )


def _broken(fit: Fit) -> Iterator[Step]:
    if fit.interrupted:
        yield Step("The search was stopped; these are its best values so far. Run it to its end.")
    for label, score in fit.runs.items():
        for name, value in score.fit_percent.items():
            if value < 0:
                yield Step(
                    f"{plain(name)} of run '{label}' is explained worse than by its mean ({percent(value)}): look at "
                    "the sign and scale of the column first; a reversed sign scores about −100 %.",
                    f"[sensors.{name}]\nsign = -1",
                )
    lost = [
        label
        for label, s in fit.runs.items()
        if s.role == "fit" and s.horizon is None and any(v < FOLLOWED for v in s.fit_percent.values())
    ]
    if lost:
        yield Step(
            f"The simulation of run {', '.join(map(repr, lost))} loses the measurement. If the figure shows that it "
            "followed at first, end the window there, or restart it from measured states.",
            '[[runs]]\nhorizon = "0.5 s"',
        )
    stopped = [n for n, e in fit.estimates.items() if e.status == "at bound"]
    none = [n for n in stopped if fit.estimates[n].value == 0]
    if none:
        yield Step(f"These runs need no {', '.join(none)}: the estimate ended at zero; leave it out.")
    for name in stopped:
        if name not in none:
            yield Step(f"{name} stopped at its bound; widen the bound or give its value as known.")


def _blind(fit: Fit) -> Iterator[Step]:
    yield from map(Step, fit.unseen)
    weak = [n for n, e in fit.estimates.items() if e.status in ("weak", "unseen")]
    if weak and not fit.unseen:
        yield Step(
            f"The data hardly see {', '.join(weak)}: measure one of them on the bench and give it as known, or add a "
            "run that moves it more.",
            f'{weak[0]} = {{ value = "…", uncertainty = "…" }}',
        )


def _nuisances(fit: Fit) -> Iterator[Step]:
    """What differs from run to run: useless factors, and predictions that chose their own."""
    homes = {f"group {group}": own for group, own in fit.groups.items()} | dict(fit.per_run)
    idle = [f"{n} of {home}" for home, own in homes.items() for n, e in own.items() if e.status == "unseen"]
    if idle:
        yield Step(f"The runs say nothing about {', '.join(idle)}: leave it out of unknown or shared.")
    for label, score in fit.runs.items():
        chosen = [n for n in score.adapted if n.partition(".")[0] in SPREADS]
        if chosen and score.role != "fit":
            yield Step(
                f"The prediction of run '{label}' chose its own {' and '.join(chosen)}, so it proves less; let the run "
                "share that with runs that are fitted.",
                f'[[runs]]\nlabel = "{label}"\nshared = {{ {chosen[0]} = "that day" }}',
            )
            return  # one example is enough


def _friction(fit: Fit, study: str, folder: str) -> Iterator[Step]:
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
    fixed = {
        name: f"{term} of {joint.on} ({name})"
        for joint in fit.rig.plant.joints
        for term, name in (("Coulomb friction", joint.coulomb), ("quadratic drag", joint.quadratic))
        if name and name not in fit.rig.estimated
    }
    if coloured and fixed:
        others = " and others" if coloured[3:] else ""
        yield Step(
            f"What is left over is not noise ({', '.join(coloured[:3])}{others}). Not estimated so far: "
            f"{'; '.join(fixed.values())}. Give them guesses; the ladder keeps those with which held-out data are "
            "predicted better.",
            f'[parameters]\n{next(iter(fixed))} = {{ guess = "…", min = 0 }}\n\nupright ladder {study} -o {folder}',
        )
