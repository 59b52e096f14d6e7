"""The chance that gains hold a rig, told before anything moves: `chance`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from upright.errors import BadInput
from upright.progress import Progress, silent
from upright.verbs.answer import Answer

if TYPE_CHECKING:
    from upright.control.preflight import Preflight


def chance(
    fit: Any, gains: Any, *, tilt: Any = None, push: Any = None, seconds: float = 6.0, speed: str = "filtered",
    memory: float = 0.5, limit: float | None = None, counts: Sequence[float] | None = None, draws: int = 200,
    seed: int = 0, workers: int = 1, cluster: str = "", progress: Progress = silent,
) -> Answer[Preflight]:  # fmt: skip
    """How likely gains are to hold the rig that a fit tells of, before anything moves.

    The run is simulated with drive limit, encoder counts, delay and dry friction of the rig's make on the rigs that
    the covariance of the fit allows, each let go as a hand would.

    Parameters
    ----------
    fit : answer of `identify` or `frequency`, or path of a fit.json
        Of a Furuta pendulum or a pendulum on a cart.
    gains : Gains or array, shape (states,)
        On the states about the inverted equilibrium, commands in the unit of the fit's drive; see `design`, or
        multiply ``plant.linear("inverted").B`` by the gain of the drive.
    tilt, push : number or text, optional
        Where the pendulum is let go [rad], and how fast [rad/s]; the make's own if left out.
    seconds, speed, memory, seed
        As in `regulate`.
    limit : float, optional
        Largest command, in its unit; the data sheet's of the make if left out.
    counts : sequence of float, optional
        Encoder counts per turn or metre, coordinate by coordinate; the data sheet's if left out.
    draws : int
        Rigs drawn.
    workers, cluster
        Processes of this machine that share them, or the address of a Dask scheduler (``tcp://host:8786``, cluster
        extra); the numbers are the same.
    progress : callable, optional
        Told how many are done.

    Raises
    ------
    BadInput
        When the fit is of no make with a drive, or the gains do not fit it.
    """
    from upright.control.preflight import WORDS, Task, preflight
    from upright.experiments.designing.run import SPEEDS, velocities
    from upright.experiments.makes import make_rig
    from upright.experiments.regulation_2.run import HAND
    from upright.gains import feedback, hold
    from upright.report.page import Chapter, Part, Table
    from upright.report.symbols import percent
    from upright.units import parse
    from upright.verbs.fitting import identified
    from upright.workers import Workers

    if speed not in SPEEDS:
        raise BadInput(f"velocities come from {', '.join(SPEEDS)}, got '{speed}'.")
    if not 0 < seconds <= 120:
        raise BadInput(f"a run takes more than 0 and at most 120 s, got {seconds:g} s.")
    if draws < 1:
        raise BadInput(f"draws needs a whole number of at least 1, got {draws}.")
    shared = Workers(number=workers, cluster=cluster)
    known = identified(fit, seed=seed, draws=draws)
    make, sheet = known.make, make_rig(known.make.key)
    if limit is None and known.unit and known.unit != sheet.unit:
        raise BadInput(
            f"the command of the fit is in {known.unit} and the limit of the data sheet in {sheet.unit}; pass limit=, "
            f"the largest command in {known.unit}."
        )
    rig = known.rig(sheet)
    if limit is not None:
        rig = replace(rig, limit=float(limit), converter=0.0 if known.unit != sheet.unit else rig.converter)
    if counts is not None:
        turns = (math.tau if c.unit == "rad" else 1.0 for c in rig.plant.coordinates)
        if len(counts) != len(rig.counts):
            raise BadInput(f"counts needs {len(rig.counts)} numbers, one for each coordinate, got {len(counts)}.")
        rig = replace(rig, counts=tuple(float(n) / turn for n, turn in zip(counts, turns, strict=True)))
    model = rig.linear("inverted")
    K = np.atleast_2d(np.asarray(gains, dtype=np.float64))
    if K.shape != (1, len(model.states)):
        raise BadInput(f"gains for {make.key} need shape {(1, len(model.states))}, got {K.shape}.")
    sampled = hold(model, rig.period, rig.delay / rig.period)
    law = feedback(velocities(model, sampled, speed, memory, rig.limit, rig.quantum), K)
    begin = [
        s if w is None else parse(w, unit) if isinstance(w, str) else float(w)
        for w, s, unit in zip((tilt, push), make.start, ("rad", "rad/s"), strict=True)
    ]
    task = Task(start=(0.0, 0.0, *begin), hand=(0.0, 0.0, *HAND), seconds=seconds)
    others = known.allowed(rig, draws, seed)
    told = preflight(
        rig, model, sampled, law, task, parameters=others, lanes=draws, seed=seed, workers=shared, progress=progress
    )
    low, high = _wilson(round(told.chance * draws), draws)
    share = f"{percent(100 * told.chance)} (95 % interval {percent(100 * low)} to {percent(100 * high)})"
    rows = tuple((word, percent(100 * told.words[word])) for word in WORDS)
    table = Table(caption="What the runs come to", headings=("outcome", "share"), rows=rows, numbers=(1,))
    limits = "" if told.margins is None else (
        f"It recovers from tilts up to {math.degrees(told.tilt):.2g}° and from taps up to {told.push:.2g} rad/s."
    )  # fmt: skip
    doubt = [] if known.draws else ["The fit has no covariance: only dry friction and the hand vary."]
    said = [name for name, value in (("drive limit", limit), ("encoder counts", counts)) if value is None]
    doubt.append(f"Taken from the data sheet of the make {make.key}: {', '.join([*said, 'servo period'])}.")
    chapter = Chapter(
        title=f"Chance that the gains hold the {rig.name}",
        verdict=f"Held for {seconds:g} s on {share} of {draws} rigs that the fit allows.", detail=limits,
        sound=told.chance > 0.95, parts=(Part("Before the run", (table,)),), warnings=tuple(doubt),
        numbers={"chance": told.chance, "interval": (low, high), "words": dict(told.words), "tilt": told.tilt,
                 "push": told.push, "noise": told.noise, "draws": draws, "seed": seed},
    )  # fmt: skip
    return Answer(told, chapter)


def _wilson(held: int, of: int) -> tuple[float, float]:
    from scipy.stats import binomtest

    interval = binomtest(held, of).proportion_ci(method="wilson")
    return float(interval.low), float(interval.high)
