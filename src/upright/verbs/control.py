"""Which gains hold a rig, and what becomes of them on it: standing, swinging up, tracking?"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput, nearest
from upright.files import keeps_its_inputs
from upright.progress import Progress, part, silent
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.handover import called, rig_of
from upright.verbs.linear.matrices import is_linear, linear_model, read_matrices
from upright.verbs.pages import (
    folder_if_given,
    page_folder,
    write_page,
    written_where_named,
)
from upright.verbs.rig import Counts, as_typed, rig_options
from upright.verbs.values import open_log, poles, si, si_if_given

if TYPE_CHECKING:
    from upright.control.sensors import Scales
    from upright.designing.run import Designed
    from upright.experiments.regulation_2.run import Regulation, RegulationRequest
    from upright.experiments.swing_up_2b.run import SwingUpRun
    from upright.experiments.tracking_3.run import Tracking
    from upright.rig import Rig
    from upright.systems import StateSpace
    from upright.verbs.values import Log

_poles = poles  # the verbs have options of this name
_FIT = "fit.json or its folder; "
_COUNTS = 'Encoder counts per turn or metre, "4096" or "x=20000, theta=4096"; the study\'s when omitted.'


@command(
    "Control",
    metavars={
        "source": "STUDY_OR_FIT", "matrices": "FILE", "at": "NAME", "lqr": "LIST", "effort_weight": "R",
        "start": "LIST", "delay": "SAMPLES", "speed": "WAY", "lag": "TIME", "track": "COORDINATE",
    },
    helps={
        "source": "fit.json, its folder, or a study (TOML).",
        "matrices": "Plain matrices instead: TOML with A and B; C, D, dt, names, units if any.",
        "start": 'Deviation to come back from, as in "theta=5 deg, psi_dot=0.2 rad/s".',
        "counts": _COUNTS,
    },
    defaults={"out": "."},
    more="""
    upright design out/fit.json --at inverted --poles "-4.15+-1.63j, -16.9, -3.2"
    upright design --matrices model.toml --poles "-4, -5" --period "2 ms"
    """,
)  # fmt: skip
@keeps_its_inputs
def design(
    source: Any = None, *, matrices: str | os.PathLike[str] | None = None, at: str = "",
    poles: str | Iterable[complex] = "", lqr: str | Iterable[float] = "", effort_weight: float | None = None,
    limit: float | None = None, start: str | Mapping[str, float | str] = "", period: float | str = "",
    delay: float | None = None, speed: str = "", memory: float = 0.5, lag: float | str = "",
    counts: float | str | Mapping[str, float] = "", vendor: str = "", track: str = "", sampled: bool = False,
    seed: int = 0, out: str | os.PathLike[str] | None = None, pdf: bool = False,
) -> Answer[Designed]:  # fmt: skip
    """Find the gains that hold a rig, and what they are worth in the loop a computer runs.

    The numbers are those identified (hanging, for instance); the model is the one about another equilibrium, upright.
    Poles are placed by Ackermann's formula, or chosen by LQR; period, delay and differenced encoders are then
    put in.

    Parameters
    ----------
    source : fit, path, plant or linear model, optional
        What `identify` answered, a fit.json, its folder, or a study (TOML), or a plant with its numbers; or a
        `control.StateSpace` or TransferFunction, ``plant.linear("inverted")``, what `hold` gives, or arrays
        ``(A, B[, C[, D]])``.
    matrices : path, optional
        Instead of `source`, a file in TOML with A and B, and C, D, dt [s], names and units where there are any. Of a
        linear model there are no dry friction, no encoders and no covariance; a sampled one is designed for as it is.
    at : str, optional
        Equilibrium; the last that the plant names when omitted.
    poles : str or sequence of complex
        Poles [1/s], as in ``"-4.15+-1.63j, -16.9, -3.2"``.
    lqr : str or sequence of float
        Weights of the states, as in ``"1,0,1,0"``, instead of poles.
    effort_weight : float, optional
        Weight of the effort; the limit decides when omitted.
    limit : float, optional
        Largest command, in the command's unit; the study's when omitted.
    start : str or mapping, optional
        Deviation to come back from, by state: ``{"theta": "5 deg"}``, ``{"theta": 0.087}`` [SI].
    period : float or str, optional
        Between samples [s]; the study's servo period when omitted.
    delay : float, optional
        How many samples late a command acts in all; when omitted the fit's delay, or one where it has none. StateSpace
        matrices hold their own.
    speed : str
        Velocities by plain or filtered difference, or kalman; filtered when omitted. Of matrices measured, filtered,
        plain or observer; the first of these that the outputs allow when omitted.
    memory : float
        Of the filtered difference, 0 to 1.
    lag : float or str, optional
        Lag of the drive [s]; the fit's when omitted.
    counts : float, str or mapping, optional
        Encoder counts per turn or metre, one number or by coordinate; the study's when omitted.
    vendor : str, optional
        Whose data sheet says what neither the call nor the study does: "ECP 205" or "ECP 210".
    track : str, optional
        Coordinate that follows a reference.
    sampled : bool
        Gains whose sampled loop has the poles asked.
    seed : int
        Of the rigs drawn from the fit's covariance.
    out : path, optional
        Folder for design.json and design.html.
    pdf : bool
        Write the page as PDF too.

    Returns
    -------
    Answer
        Of a `Designed`: gains `K`, `poles`, margins.

    Raises
    ------
    BadInput
        When the call contradicts itself or the rig, or a pole is out of the input's reach.
    """
    from upright.designing.chapter import chapter
    from upright.designing.run import SPEEDS, DesignRequest, design_for
    from upright.files import write_json
    from upright.report.symbols import typed
    from upright.rig.completion import completed

    folder_at = folder_if_given(out, pdf)
    asked, weights = _poles(poles), _numbers(lqr)
    if (asked is None) == (weights is None):
        raise BadInput('give either --poles "-4+-2j, -10, -3" or --lqr "1,0,1,0" (weights of the states).')
    if (source is None) == (matrices is None):
        raise BadInput("design takes a fit.json, its folder, a study or a linear model, or --matrices FILE; give one.")
    wish = DesignRequest(
        at="", poles=asked, weights=weights, R=effort_weight, delay=delay, lag=si_if_given(lag, "s"), memory=memory,
        track=track, sampled=sampled,
    )  # fmt: skip
    if matrices is not None or is_linear(source):
        if at or counts or vendor:
            raise BadInput("--at, --counts and --vendor are of a rig, and plain matrices are none; leave them out.")
        rig = read_matrices(matrices) if matrices is not None else linear_model(source)
        wish = replace(wish, period=_sampling(rig, period), speed=speed, limit=limit, start=_start(rig, start))
        name = "--matrices " + (typed(Path(matrices)) if matrices is not None else "FILE")
    else:
        if (speed := speed or "filtered") not in SPEEDS:
            raise BadInput(f"--speed is plain, filtered or kalman, got '{speed}'.")
        rig = rig_of(source, "design", seed=seed)
        here = at or list(rig.plant.equilibria)[-1]
        if here not in rig.plant.equilibria:
            raise BadInput(f"'{rig.name}' has no equilibrium '{here}'; {nearest(here, rig.plant.equilibria)}")
        given = rig_options(rig.plant, rig.unit, limit=limit, period=period, counts=counts)
        on = completed(rig, given, vendor=vendor, needs=("servo_period", "counts"), who="upright design")
        wish = replace(
            wish, at=here, period=on.period, speed=speed, quantum=tuple(on.quantum.tolist()),
            limit=on.saturation if math.isfinite(on.saturation) else None, start=_start(rig, start), on=on,
        )  # fmt: skip
        name = called(source)
    done = design_for(rig, wish)
    again = as_typed(limit=limit, period=period, counts=counts, vendor=vendor)
    told = chapter(done, source=name + again, folder=typed(folder_at or Path()))
    files: list[Path] = []
    if folder_at is not None:
        files = [
            write_json(folder_at / "design.json", told.numbers),
            *write_page(told, folder_at / "design.html", pdf),
        ]
    return Answer(done, told, files)


def _sampling(model: StateSpace, period: float | str) -> float:
    """Period of the loop [s]; that of sampled matrices is theirs."""
    asked = si_if_given(period, "s")
    if asked is None and not model.dt:
        raise BadInput('these matrices are continuous, and a computer closes the loop: say how often, --period "2 ms".')
    if asked is not None and model.dt and not math.isclose(asked, model.dt, rel_tol=1e-9):
        raise BadInput(
            f"these matrices are sampled every {1e3 * model.dt:.6g} ms, and a period of {1e3 * asked:.6g} ms was "
            "asked for; leave --period out, or give a continuous model."
        )
    return model.dt or asked or 0.0


def _numbers(given: str | Iterable[float]) -> tuple[float, ...] | None:
    if not isinstance(given, str):
        return tuple(float(x) for x in given) or None
    if not given:
        return None
    try:
        return tuple(float(part) for part in given.split(","))
    except ValueError:
        raise BadInput(f'weights are numbers separated by commas, as in "1,0,1,0", got {given[:60]!r}.') from None


def _start(rig: Rig | StateSpace, given: str | Mapping[str, float | str]) -> tuple[float, ...]:
    """Deviation, state by state in its unit; empty when none was given."""
    from upright.units import scale

    if isinstance(given, str):
        parts = [part.partition("=") for part in given.split(",")] if given.strip() else []
        said: dict[str, float | str] = {name.strip(): value for name, _, value in parts}
    else:
        said = dict(given)
    if not said:
        return ()
    names = rig.states
    units = dict(zip(names, rig.state_units, strict=True))
    values = dict.fromkeys(names, 0.0)
    for name, value in said.items():
        if name not in values:
            raise BadInput(f"--start names states as in \"theta=5 deg\", got '{name}'; {nearest(name, names)}")
        values[name] = si(value, units[name]) / (scale(units[name]) if isinstance(value, str) else 1.0)
    if not any(values.values()):
        raise BadInput("--start must leave the equilibrium; give one state a value that is not 0.")
    return tuple(values.values())


@command(
    "Control",
    defaults={"out": "upright-regulate"},
    names={"which": "--set"},
    metavars={"source": "[FIT]", "rig": "MAKE", "which": "N", "tilt": "ANGLE", "push": "SPEED"},
    helps={
        "source": _FIT + "a twin is identified without it.",
        "which": "Pole set of Table 1, 1 to 4, or all.",
        "poles": 'Poles [1/s] of your own: "-4.15+-1.63j, -16, -3".',
        "tilt": 'From upright when let go, as in "12 deg".',
        "push": 'Speed of the pendulum then, outwards: "1.5 rad/s".',
        "counts": _COUNTS,
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
        vendor = _vendor(known, rig, vendor, name)
        name += as_typed(limit=limit, period=period, counts=counts, travel=travel, vendor=vendor)
    given = rig_options(known.plant, known.unit, limit=limit, period=period, counts=counts, travel=travel)
    on = completed(known, given, vendor=vendor, who="upright regulate")
    truth = None if seed is None else twin_of(on, seed)
    done = run_regulation(
        on, truth, seed or 0, at, lambda step, share: progress(step, base + (1 - base) * share), wish=wish,
        source=name, workers=shared,
    )  # fmt: skip
    told = chapter(done)
    if source is not None:
        told = replace(told, warnings=(*told.warnings, *doubts(known, on, truth)))
    files = write_page(told, at / "report.html", pdf)
    numbers = {**told.numbers, "verdict": told.verdict, "report": str(files[0])}
    return Answer(done, replace(told, numbers=numbers), files)


def _vendor(known: Rig, rig: str, vendor: str, source: str) -> str:
    """Data sheet chosen by the name of a make, ``--rig``, or of the vendor."""
    if not rig:
        return vendor
    from upright.rig.makes import make_of_rig

    make = make_of_rig(known)
    if rig != make.key:
        raise BadInput(f"{source} is of the make '{make.key}', not '{rig}'; leave --rig out.")
    return vendor or make.vendor


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


@command(
    "Control",
    defaults={"out": "swing-up"},
    metavars={"source": "[FIT]", "lie": "NAME=FACTOR", "check": "LOG"},
    helps={
        "source": _FIT + "the law is designed from it, else from the data sheet.",
        "lie": 'An encoder shows a multiple of what is true: "theta=2".',
        "counts": _COUNTS,
    },
    ranges={"seconds": (1.0, 120.0)},
    wrong=lambda done: not done.value.sound,  # whatever its model is worth
    more="""
    upright swing-up --rig linear --seed 3

    With your own rig: drive it from rest, hanging, until it swings to 60 degrees or
    more, let it coast, and have its encoders checked (columns u, theta, psi or x).

    upright swing-up out/fit.json --check swings.csv
    """,
)
@written_where_named
@keeps_its_inputs
def swing_up(
    source: Any = None, *, rig: str = "", seed: int = 1, seconds: float = 12.0,
    travel: float | None = None, limit: float | None = None, period: float | str = "", counts: Counts = "",
    vendor: str = "", lie: str | Mapping[str, float] = "", check: Log | None = None,
    out: str | os.PathLike[str] | None = None, pdf: bool = False,
) -> Answer[SwingUpRun | Scales]:  # fmt: skip
    """Swing a hanging pendulum up by its own drive and catch it, once its encoders are trusted.

    The drive's limit and travel are kept. The law is designed from a fit, or from the make's data sheet, and meets a
    twin with numbers of its own. Logs can be shown, identified and predicted as any other.

    Parameters
    ----------
    source : fit, path or plant, optional
        What `identify` answered, or the fit.json that the law is designed from; the make's data sheet when omitted.
    rig : str, optional
        furuta or linear; with a fit, the make whose vendor is chosen.
    seed : int
        Which rig of the make, 0 is the one as designed; or which rig that the fit's covariance allows where no vendor
        is named.
    seconds : float
        Time for the way up and for holding, 1 to 120 s.
    travel : float, optional
        How far the driven body may go [m or rad]; the study's when omitted, as for the next three.
    limit : float, optional
        Largest command, in its unit.
    period : float or str, optional
        Servo period [s].
    counts : float, str or mapping, optional
        Encoder counts per turn or metre, one number or by coordinate.
    vendor : str, optional
        Whose data sheet says what neither the call nor the study does: "ECP 205" or "ECP 210".
    lie : str or mapping, optional
        An encoder shows a multiple of what is true: ``{"theta": 2}``.
    check : path, Record or pandas.DataFrame, optional
        Only say what this log of a hanging, driven rig tells of its encoders.
    out : path, optional
        Folder for all files; in Python none is written without one.
    pdf : bool
        Write the page as PDF too.

    Returns
    -------
    Answer
        Of a `SwingUpRun`, which says whether it was `caught`; of the encoders' `Scales` when only they are asked.

    Raises
    ------
    BadInput
        When the call contradicts itself or the fit, or the log cannot be used.
    """
    from upright.experiments.swing_up_2b.chapter import chapter, check_chapter
    from upright.experiments.swing_up_2b.run import known_of, run_swing_up, scales_of_log
    from upright.files import write_json
    from upright.rig.completion import completed, doubts, twin_of
    from upright.rig.makes import make_rig

    at = page_folder(out, pdf)
    if not 1 <= seconds <= 120:
        raise BadInput(f"--seconds needs a time from 1 to 120 s, got {seconds:g}.")
    if travel is not None and not travel > 0:
        raise BadInput(f"--travel must be above 0, got {travel:g}; give it in m or rad.")
    known, doubt = None, ()
    if source is None:
        for option, value in (("limit", limit), ("period", period), ("counts", counts), ("vendor", vendor)):
            if value not in (None, ""):
                raise BadInput(f"--{option} is for a rig of your own: name its fit.json first.")
        model, truth = make_rig(rig or "furuta"), make_rig(rig or "furuta", seed)
    else:
        identified = rig_of(source, "swing_up", seed=seed)
        known, vendor = known_of(identified), _vendor(identified, rig, vendor, called(source))
        given = rig_options(
            identified.plant, identified.unit, limit=limit, period=period, counts=counts, travel=travel
        )  # fmt: skip
        needs = ("limit", "servo_period", "counts", "travel")
        model = completed(identified, given, vendor=vendor, needs=needs, who="upright swing-up")
        described = check is not None or not (model.draws or model.hardware.vendor)
        truth = model if described else twin_of(model, seed)
        doubt = doubts(identified, model, None if described else truth)
        if described and check is None:
            doubt = (*doubt, "Nothing says what else the rig may be, so the law meets the numbers it was made from.")
    again = as_typed(travel=travel, limit=limit, period=period, counts=counts, vendor=vendor)
    name = "" if source is None else called(source) + again
    if check is not None:
        record, log = open_log(check)
        scales = scales_of_log(model, record, known)
        told = check_chapter(model, scales, log.name, name or "FIT.json")
        told = replace(told, warnings=(*told.warnings, *doubt))
        return Answer(scales, told, write_page(told, at / "encoders.html", pdf))
    done = run_swing_up(model, _lying(truth, lie), at, known=known, seconds=seconds, travel=travel, source=name)
    told = chapter(done)
    told = replace(told, warnings=(*told.warnings, *doubt))
    return Answer(
        done, told, [*write_page(told, at / "swing_up.html", pdf), write_json(at / "swing_up.json", told.numbers)]
    )


def _lying(rig: Rig, lie: str | Mapping[str, float]) -> Rig:
    """The rig with one encoder that shows a multiple of what is true."""
    if isinstance(lie, str):
        said = [(name.strip(), value.strip()) for name, _, value in [lie.partition("=")] if lie.strip()]
    else:
        said = [(name, str(value)) for name, value in lie.items()]
    names = [c.name for c in rig.plant.coordinates]
    factors = dict.fromkeys(names, 1.0)
    for name, value in said:
        if name not in names:
            raise BadInput(f"--lie names a coordinate as in \"theta=2\", got '{name}'; {nearest(name, names)}")
        try:
            factor = float(value)
        except ValueError:
            factor = 0.0
        if not 0.01 <= abs(factor) <= 100:
            raise BadInput(
                f"--lie needs a factor between 0.01 and 100, or negative for swapped channels, got '{value}'."
            )
        factors[name] = factor
    return replace(rig, scales=tuple(factors.values())) if said else rig


@command(
    "Control",
    defaults={"out": "track"},
    names={"sets": "--set"},
    metavars={"source": "[FIT]", "sets": "LIST", "step": "SIZE"},
    helps={
        "source": "fit.json, its folder, or a study; a twin without it.",
        "sets": "Sets of Table 2, as in 1,4.",
        "poles": 'Poles [1/s] of your own: "-10+-20j, -25+-10j".',
        "step": 'Size of the step, as in "5 mm" or "10 deg".',
        "counts": _COUNTS,
    },
    more="""
    upright track --rig torsional --seed 3 -o out
    upright track out/fit.json --set 4 --step "6 mm"
    """,
)
@written_where_named
@keeps_its_inputs
def track(
    source: Any = None, *, rig: str = "rectilinear", seed: int = 0,
    sets: str | int | Sequence[int] = "", poles: str | Iterable[complex] = "", step: float | str = "",
    limit: float | None = None, period: float | str = "", counts: Counts = "", vendor: str = "",
    out: str | os.PathLike[str] | None = None, pdf: bool = False, progress: Progress = silent,
) -> Answer[Tracking]:  # fmt: skip
    """Make the far inertia of a flexible shaft follow a step, by state feedback and by PD.

    This is experiment 3: identifies a twin from a few pulses, places the poles of Table 2, sizes the step by effort,
    twist and travel, predicts its figures and runs it; PD control stands beside. With a fit of your own rig the figures
    are predicted on the fitted numbers.

    Parameters
    ----------
    source : fit, path or plant, optional
        What `identify` answered, fit.json, its folder, or a study, on whose numbers the figures are predicted; a twin
        when omitted.
    rig : str
        Twin to run on: rectilinear (ECP 210) or torsional (ECP 205).
    seed : int
        Which twin of the make; 0 is the one as designed.
    sets : str, int or sequence of int, optional
        Sets of Table 2, the command line's ``--set``; all when neither they nor poles are given.
    poles : str or sequence of complex, optional
        Poles of one's own [1/s].
    step : float or str, optional
        Size of the step [m or rad]; chosen by effort, twist and travel when omitted.
    limit : float, optional
        Largest command; the make's own, or the study's, when omitted.
    period : float or str, optional
        Servo period [s] of a rig of your own; the study's when omitted.
    counts : float, str or mapping, optional
        Encoder counts of a rig of your own, per turn or metre; the study's when omitted.
    vendor : str, optional
        Whose data sheet says what neither the call nor the study does: "ECP 205" or "ECP 210".
    out : path, optional
        Folder for all files; in Python none is written without one.
    pdf : bool
        Write the page as PDF too.
    progress : callable, optional
        Told the step at work and the share done.

    Returns
    -------
    Answer
        Of a `Tracking`; `interrupted` when Ctrl-C stopped it.

    Raises
    ------
    BadInput
        When there is no such rig or set, or poles cannot be placed.
    """
    from upright.experiments.tracking_3.chapter import chapter
    from upright.experiments.tracking_3.pulses import rig_of_file, shaft_make
    from upright.experiments.tracking_3.run import follow, run_tracking
    from upright.files import write_json
    from upright.rig.completion import completed, doubts
    from upright.rig.makes import SHAFTS, make_rig

    at = page_folder(out, pdf)
    own = _poles(poles)
    which = _sets(sets) or (() if own is not None else (1, 2, 3, 4))
    if limit is not None and not limit > 0:
        raise BadInput(f"--limit must be above 0, got {limit:g}.")
    if source is None and rig not in SHAFTS:
        raise BadInput(f"--rig is {' or '.join(SHAFTS)}, got '{rig}'.")
    doubt: tuple[str, ...] = ()
    if source is None:
        on = make_rig(rig, seed)
    else:
        known = rig_of(source, "track")
        shaft_make(known.plant, f"'{known.name}'")
        given = rig_options(known.plant, known.unit, limit=limit, period=period, counts=counts)
        on = rig_of_file(completed(known, given, vendor=vendor, who="upright track"), Path(called(source)).name)
        doubt = doubts(known, on)
    size = si_if_given(step, on.plant.coordinates[-1].unit)
    if size is not None and not size > 0:
        raise BadInput(f"--step needs a size above 0, got '{step}'.")
    if source is None:
        on = on.replace(limit=limit or on.limit)
        done = run_tracking(on, seed, at, progress, which=which, poles=own, step=size)
    else:
        done = follow(on, on, Path(called(source)), None, None, progress, which=which, poles=own, step=size)
    told = chapter(done)
    told = replace(
        told, title=f"Experiment 3: {told.title.lower()}, {done.rig.name}",
        numbers={**told.numbers, "verdict": told.verdict}, warnings=(*told.warnings, *doubt),
    )  # fmt: skip
    return Answer(done, told, [write_json(at / "track.json", told.numbers), *write_page(told, at / "track.html", pdf)])


def _sets(given: str | int | Sequence[int]) -> tuple[int, ...]:
    if isinstance(given, int):
        return (given,)
    if not isinstance(given, str):
        return tuple(given)
    try:
        return tuple(int(part) for part in given.split(",")) if given else ()
    except ValueError:
        raise BadInput(
            f'--set takes numbers of Table 2 separated by commas, as in "1,4", got {given[:40]!r}.'
        ) from None
