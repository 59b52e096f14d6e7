"""A rig in a minute: its wiring from first motions, a fit of them, gains, swing-up and catch, without a hand at it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from upright.control import SwingUp, design_swing_up
from upright.control.exploration import CALMS, KICKS, PUMPS, SECONDS, exploration
from upright.control.sensors import SURE
from upright.control.swing_up import Ascent, ascent_of
from upright.control.trial import steps_in_period
from upright.control.wiring import WiringCheck, check_wiring
from upright.errors import BadInput
from upright.experiments.stand.fits import fit_study
from upright.experiments.stand.live import LiveStand
from upright.experiments.stand.stand import APPLIED, file_of
from upright.experiments.stand.studies import write_study
from upright.identification.model.fit import Fit
from upright.progress import Progress, part, silent
from upright.records import Array, Record
from upright.rig import Rig
from upright.rig.completion import completed
from upright.rig.variation import allowed
from upright.simulation import simulate
from upright.study.load import Study
from upright.study.stored_rig import read_stored_rig

LANES = 24
"""Rigs that the fit allows, on which the swing-up is tried before it is run."""
ENOUGH = 0.5
"""Share of them that must be caught."""
UP = 14.0
"""Time for the way up and for holding [s]."""
HELD = 3.0
"""How long it must stand at the end to be called upright [s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class QuickRun:
    """What a minute at a rig came to; it ends at the first thing that forbids to go on.

    Attributes
    ----------
    stand : LiveStand
    log, mode : Record, array of shape (N,)
        Of the first motions, and what they were for (`control.exploration`).
    wiring : WiringCheck
    model : Rig or None
        As identified.
    study, fit : Study, Fit or None
    law : SwingUp or None
    share : float or None
        Of the rigs that the fit allows, how many are caught in simulation; None where no law was designed.
    ascent : Ascent or None
    ended : str or None
        Why the swing-up ended early.
    refused : str or None
        Why a loop was not closed.
    seconds : float
        At the rig, by its own clock [s].
    """

    stand: LiveStand
    log: Record
    mode: Array
    wiring: WiringCheck
    seconds: float
    model: Rig | None = None
    study: Study | None = None
    fit: Fit | None = None
    law: SwingUp | None = None
    share: float | None = None
    ascent: Ascent | None = None
    ended: str | None = None
    refused: str | None = None

    @property
    def upright(self) -> bool:
        """Whether it stands at the end."""
        a = self.ascent
        return a is not None and not self.ended and a.up <= float(a.trial.t[-1]) - HELD


def run_quick(
    stand: LiveStand, folder: Path, seed: int = 0, progress: Progress = silent,
    stopped: Callable[[], bool] = lambda: False,
) -> QuickRun:  # fmt: skip
    """Find out how a rig is wired, identify it from the same motions, and swing it up.

    Parameters
    ----------
    stand : LiveStand
    folder : Path
        Takes logs, study.toml, fit.json and the RIG.toml of the identified rig.
    seed : int
        Of the rigs drawn from the fit.
    progress, stopped : callable, optional

    Raises
    ------
    RigStopped
        When a limit stopped the rig, or it was not left to rest.
    """
    driven, pendulum = stand.names
    stand.ask(
        f"Let {pendulum} hang at rest, with {driven} in the middle of its travel, and keep clear: for a minute it "
        "moves by itself, and ends upright."
    )
    progress("first motions", 0.0)
    rule = exploration(stand.rig, stand.travel)
    log = stand.explore(rule, SECONDS, folder, "explore")
    shown = np.column_stack([log[n] for n in stand.names])
    mode = rule.follow(shown, stand.rig.period)[1][:, 0]
    check = check_wiring(stand.rig, log.t, shown - shown[0], log[APPLIED])
    result = QuickRun(stand=stand, log=log, mode=mode, wiring=check, seconds=float(log.t[-1]))
    if not check.wrong and not np.any(mode == PUMPS):
        return replace(result, refused="the drive hardly moves it: look at its supply and its current limit")
    if check.wrong:
        return replace(result, refused="; ".join(what for what, _ in check.wrong))
    study, fit = fit_study(_study(stand, log, mode, check, folder), part(progress, 0.3, 0.8, "fitting the motion"))
    if fit.interrupted or stopped():
        raise KeyboardInterrupt
    described = stand.described_by(folder / "fit.json", folder)
    known = read_stored_rig(folder / "fit.json", seed=seed)
    model = completed(known, vendor=stand.vendor, who="a minute at a rig", options=False).replace(name=stand.rig.name)
    progress("designing", 0.8)
    try:
        law = design_swing_up(model, travel=stand.travel, speeds=stand.speeds, seed=seed)
    except BadInput as error:
        return replace(result, study=study, fit=fit, model=model, refused=str(error).rstrip("."))
    share = caught(model, law, seed)
    result = replace(result, study=study, fit=fit, model=model, law=law, share=share)
    if share < ENOUGH:
        return replace(result, refused=f"of {LANES} rigs that the fit allows only {share:.0%} are caught")
    progress("swinging up", 0.9)
    law_of_rig = law.rule(described.rig, described.rig.plant.state(described.resting))
    run = described.hold(law_of_rig, "inverted", folder, "swing_up", UP, settled=True)
    began, ended = float(log.t[-1]), float(run.trial.t[-1])
    return replace(result, seconds=began + ended, ascent=ascent_of(run.trial, law, law_of_rig), ended=run.ended)


def _study(stand: LiveStand, log: Record, mode: Array, check: WiringCheck, folder: Path) -> Path:
    """The study of the first motions: from the first kick on they are fitted, and calming is foreseen.

    A dead zone that they show is estimated too.
    """
    more = {}
    if check.dead_zone is not None and check.dead_error is not None and check.dead_zone > SURE * check.dead_error:
        more = {"dead_zone": {"guess": f"{check.dead_zone:.6g} {stand.rig.unit}", "min": 0}}
    t, kicks, calms = log.t, np.flatnonzero(mode >= KICKS), np.flatnonzero(mode >= CALMS)
    runs = [
        {"label": "first motions", "file": file_of(log), "window": [float(t[kicks[0]]), float(t[calms[0]])]},
        {"label": "calming", "file": file_of(log), "window": [float(t[calms[0]]), float(t[-1])], "role": "predict"},
    ]
    return write_study(stand, folder / "study.toml", f"A minute at {stand.rig.name}", runs, actuator=more)


def caught(model: Rig, law: SwingUp, seed: int) -> float:
    """Share of the rigs that a model's fit allows which a swing-up brings upright within their travel."""
    start = np.tile(model.plant.state("hanging"), (LANES, 1))
    samples = round(UP / model.period)
    x = simulate(
        model.plant, dict(model.drive) | dict(allowed(model, LANES, seed)), start, None, model.period, samples=samples,
        substeps=steps_in_period(model), loop=law.rule(model, start),
    )  # fmt: skip
    last = np.mod(x[-round(HELD / model.period) :, 2], 2 * math.pi) - math.pi
    stands = np.abs(last).max(axis=0) < math.radians(10)
    return float(np.mean(stands & (np.abs(x[:, 0]).max(axis=0) < law.travel)))
