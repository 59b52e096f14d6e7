"""A rig held upright, with a prediction beforehand: `regulate`."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput
from upright.files import keeps_its_inputs
from upright.progress import Progress, part, silent
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.control.options import COUNTS, FIT, vendor_of
from upright.verbs.handover import called, rig_of
from upright.verbs.pages import page_folder, write_page, written_where_named
from upright.verbs.rig import Counts, as_typed, rig_options
from upright.verbs.values import poles, si_if_given

if TYPE_CHECKING:
    from upright.experiments.regulation_2.run import Regulation, RegulationRequest

_poles = poles  # the verbs have options of this name


@command(
    "Control",
    defaults={"out": "upright-regulate"},
    names={"which": "--set"},
    metavars={"source": "[FIT]", "rig": "MAKE", "which": "N", "tilt": "ANGLE", "push": "SPEED"},
    helps={
        "source": FIT + "a twin is identified without it.",
        "which": "Pole set of Table 1, 1 to 4, or all.",
        "poles": 'Poles [1/s] of your own: "-4.15+-1.63j, -16, -3".',
        "tilt": 'From upright when let go, as in "12 deg".',
        "push": 'Speed of the pendulum then, outwards: "1.5 rad/s".',
        "counts": COUNTS,
    },
    ranges={"draws": (1, None)},
    more="""
    upright regulate --rig furuta --seed 3
    upright regulate out/fit.json --seed 3 --set 2 --tilt "20 deg"
    """,
)
@written_where_named
@keeps_its_inputs
def regulate(
    source: Any = None, *, rig: str = "", seed: int | None = None, which: int | str = "",
    poles: str | Iterable[complex] = "", speed: str = "filtered", memory: float = 0.5, tilt: float | str = "",
    push: float | str = "", seconds: float = 6.0, draws: int = 200, limit: float | None = None,
    period: float | str = "", counts: Counts = "", travel: float | None = None, vendor: str = "",
    out: str | os.PathLike[str] | None = None, pdf: bool = False, workers: int = 1, cluster: str = "",
    progress: Progress = silent,
) -> Answer[Regulation]:  # fmt: skip
    """Hold an identified rig upright; say beforehand what each pole set will come to.

    Gains are placed on the numbers identified while the rig hung. What will come is simulated with limit, counts, delay
    and dry friction, on rigs as the fit's covariance allows; the laws then run on a twin, and both are put side by
    side.

    Parameters
    ----------
    source : fit, path or plant, optional
        What `identify` answered, fit.json or its folder, or a plant with its numbers; a twin is identified when
        omitted.
    rig : str, optional
        Twin to identify: furuta or linear; with a fit, the make whose vendor is chosen.
    seed : int, optional
        Which twin of the make runs, or which rig that the fit's covariance allows where no vendor is named; with a fit
        and no seed nothing is run.
    which : int or str, optional
        Pole set of Table 1, 1 to 4, or all; the command line's ``--set``.
    poles : str or sequence of complex, optional
        Poles of one's own [1/s].
    speed : str
        Velocities by plain or filtered difference, or kalman.
    memory : float
        Of the filtered difference, 0 to 1.
    tilt : float or str, optional
        From upright when let go [rad].
    push : float or str, optional
        Speed of the pendulum then, outwards [rad/s].
    seconds : float
        Length of a run.
    draws : int
        Rigs that the fit's covariance allows, from which the chance is taken.
    limit : float, optional
        Largest command, in its unit; the study's when omitted, as for the next three.
    period : float or str, optional
        Servo period [s].
    counts : float, str or mapping, optional
        Encoder counts per turn or metre, one number or by coordinate.
    travel : float, optional
        How far the driven body may go either way [m or rad].
    vendor : str, optional
        Whose data sheet says what neither the call nor the study does: "ECP 205" or "ECP 210".
    out : path, optional
        Folder for all files; in Python none is written without one.
    pdf : bool
        Write the page as PDF too.
    workers, cluster
        Who simulates those rigs: processes of this machine, or the address of a Dask scheduler.
    progress : callable, optional
        Told the step at work and the share done.

    Returns
    -------
    Answer
        Of a `Regulation`.

    Raises
    ------
    BadInput
        When the call contradicts itself or the fit, or poles cannot be placed.
    """
    from upright.experiments.regulation_2.chapter import chapter
    from upright.experiments.regulation_2.run import identify_make, run_regulation
    from upright.experiments.stand.twin import TwinStand
    from upright.rig.completion import completed, doubts, twin_of
    from upright.workers import Workers

    shared = Workers(number=workers, cluster=cluster)
    at = page_folder(out, pdf)
    wish = _wish("" if which == "" else str(which), poles, speed, memory, tilt, push, seconds, draws)
    if source is None:
        make, seed = rig or "furuta", seed or 0
        progress("identifying the hanging twin", 0.0)
        known = identify_make(make, seed, at / "identified", part(progress, 0.0, 0.6, "identifying"), draws)
        name, base = f"--rig {make}", 0.6
    else:
        known, name, base = rig_of(source, "regulate", seed=seed or 0, draws=draws), called(source), 0.0
        vendor = vendor_of(known, rig, vendor, name)
        name += as_typed(limit=limit, period=period, counts=counts, travel=travel, vendor=vendor)
    given = rig_options(known.plant, known.unit, limit=limit, period=period, counts=counts, travel=travel)
    on = completed(known, given, vendor=vendor, who="upright regulate")
    truth = None if seed is None else twin_of(on, seed)
    done = run_regulation(
        on, None if truth is None else TwinStand(rig=truth), seed or 0, at,
        lambda step, share: progress(step, base + (1 - base) * share), wish=wish,
        source=name, workers=shared,
    )  # fmt: skip
    told = chapter(done)
    if source is not None:
        told = replace(told, warnings=(*told.warnings, *doubts(known, on, truth)))
    files = write_page(told, at / "report.html", pdf)
    numbers = {**told.numbers, "verdict": told.verdict, "report": str(files[0])}
    return Answer(done, replace(told, numbers=numbers), files)


def _wish(
    which: str, poles: str | Iterable[complex], speed: str, memory: float, tilt: float | str, push: float | str,
    seconds: float, draws: int,
) -> RegulationRequest:  # fmt: skip
    from upright.experiments.regulation_2.run import SETS, RegulationRequest
    from upright.gains.requests import read_poles

    own = _poles(poles)
    if which and own is not None:
        raise BadInput("give either --set, a set of Table 1, or --poles of your own.")
    if which not in ("", "all") and f"set {which}" not in SETS:
        raise BadInput(f"--set is 1 to {len(SETS)}, or all, got '{which}'.")
    printed = {n: read_poles(t) for n, t in SETS.items() if which in ("", "all", n[4:])}
    return RegulationRequest(
        poles=printed if own is None else {"your poles": own}, speed=speed, memory=memory, seconds=seconds,
        draws=draws, tilt=si_if_given(tilt, "rad"), push=si_if_given(push, "rad/s"),
    )  # fmt: skip
