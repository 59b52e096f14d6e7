"""Predicted probability that gains stabilise a rig: `chance`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Unpack

from upright.errors import BadInput
from upright.progress import Progress, silent
from upright.renamed import CLUSTER, LET_GO, renamed
from upright.verbs.answer import Answer
from upright.verbs.linear.motion import read_gains
from upright.verbs.options import TrialOptions, known_options, rig_entries
from upright.verbs.values import read_start

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from upright.control.preflight import Preflight
    from upright.designing.run import Designed
    from upright.laws import Law
    from upright.rig import Rig
    from upright.verbs.forms import RigLike
    from upright.verbs.linear.feedback import Gains
    from upright.verbs.values import Workforce

UNSUPPORTED = (
    "The probability of stabilisation is not supported: it would be that of the model, and the rig is not known to be "
    "like it. Identify the rig so that its fit is trusted, then ask again."
)


@renamed({**LET_GO, **CLUSTER})
def chance(
    fit: RigLike, gains: Gains | Answer[Designed] | ArrayLike, *, seed: int = 0, workers: Workforce = 1,
    progress: Progress = silent, **on: Unpack[TrialOptions],
) -> Answer[Preflight]:  # fmt: skip
    """How likely gains are to hold the rig that a fit tells of, before anything moves.

    The run is simulated with drive limit, encoder counts, delay and dry friction of the rig as its study describes it,
    on the rigs that the covariance of the fit allows, each let go as a hand would.

    Parameters
    ----------
    fit : answer of `identify` or `frequency`, or path of a fit.json
        Of a Furuta pendulum or a pendulum on a cart.
    gains : answer of `design`, Gains or array, shape (states,)
        A design's law is tried as it is, and its limit is the drive's where the fit says none. Gains act on the states
        about the inverted equilibrium, commands in the unit of the fit's drive: multiply
        ``plant.linear("inverted").B`` by the gain of the drive.
    seed : int
        Of the rigs that are drawn.
    workers : int, str or executor
        Who simulates them, as in `regulate`.
    progress : callable, optional
        Called with how many are completed.
    **on
        Of the trial, start, seconds, draws; of the rig and its loop, limit, period, counts, vendor, travel, speed,
        memory; see `TrialOptions`.

    Raises
    ------
    BadInput
        When something of the rig is not known, or the gains do not fit it.
    """
    from upright.basis import NOT_SUPPORTED, SIMULATED, in_percent
    from upright.control.preflight import WORDS, Task, preflight
    from upright.designing.run import SPEEDS, Designed, velocities
    from upright.experiments.regulation_2.run import HAND, START
    from upright.gains import feedback
    from upright.report.page import Chapter, Part, Table, resting_on
    from upright.report.rig import rig_table
    from upright.rig.completion import completed, doubts
    from upright.rig.makes import make_of_vendor
    from upright.rig.variation import allowed
    from upright.verbs.handover import rig_of
    from upright.workers import Workers

    on = known_options(TrialOptions, on, "chance")
    seconds, draws = on.get("seconds", 6.0), on.get("draws", 200)
    speed, memory = on.get("speed") or "filtered", on.get("memory", 0.5)
    if speed not in SPEEDS:
        raise BadInput(f"velocities come from {', '.join(SPEEDS)}, got '{speed}'.")
    if not 0 < seconds <= 120:
        raise BadInput(f"a run takes more than 0 and at most 120 s, got {seconds:g} s.")
    if draws < 1:
        raise BadInput(f"draws needs a whole number of at least 1, got {draws}.")
    shared = Workers.of(workers)
    known = rig_of(fit, "chance", seed=seed, draws=draws)
    answered: Any = gains.value if isinstance(gains, Answer) else None  # of whichever verb
    designed = answered if isinstance(answered, Designed) else None
    if designed is not None and "limit" not in known.hardware.entries and designed.request.limit is not None:
        on = {"limit": designed.request.limit, **on}
    entries = rig_entries(known.plant, known.unit, on)
    rig = completed(known, entries, vendor=on.get("vendor"), who="chance")
    make = make_of_vendor(rig.hardware.vendor, rig.plant)
    usual = make.start if make else START
    model = rig.linear("inverted")
    sampled = model.to_sampled(rig.period, rig.delay / rig.period)
    if designed is None:
        refusal = f"chance takes gains, a number for each state, got {gains!r:.40}."
        K = read_gains(gains, (1, len(model.states)), known.name, refusal)
        law = feedback(velocities(model, sampled, speed, memory, rig.limit, rig.resolution), K)
    else:
        law = _of_design(designed, rig, [n for n in ("speed", "memory") if n in on])
    let_go = dict(zip(("theta", "theta_dot"), usual, strict=True))
    let_go |= read_start(on.get("start"), ("theta", "theta_dot"), ("rad", "rad/s"))
    task = Task(start=(0.0, 0.0, *let_go.values()), hand=(0.0, 0.0, *HAND), seconds=seconds)
    others = allowed(rig, draws, seed)
    predicted = preflight(
        rig, model, sampled, law, task, parameters=others, lanes=draws, seed=seed, workers=shared, progress=progress
    )
    low, high = predicted.interval
    share = f"{in_percent(predicted.share)} (95 % interval {in_percent(low)} to {in_percent(high)})"
    supported = predicted.basis.supported
    rows = tuple((word, in_percent(predicted.words[word])) for word in WORDS)
    caption = "What the runs come to" if predicted.basis.supports else (
        f"What simulated runs of the model come to; of the rig that is {NOT_SUPPORTED}"
    )  # fmt: skip
    table = Table(caption=caption, headings=("outcome", "share"), rows=rows, numbers=(1,))
    limits = "" if predicted.margins is None else (
        f"It recovers from tilts up to {math.degrees(predicted.tilt):.2g}° and taps up to {predicted.push:.2g} rad/s."
    )  # fmt: skip
    doubt = [] if known.draws else ["The fit has no covariance: only dry friction and the hand vary."]
    doubt += doubts(known, rig)
    chapter = Chapter(
        title=f"Probability that the gains stabilise the {rig.name}",
        verdict=f"Stabilised for {seconds:g} s on {share} of {draws} rigs sampled from the fit's covariance"
        f"{_effort(predicted)}" if predicted.basis.supports else UNSUPPORTED, detail=limits,
        sound=predicted.quiet_share > 0.95, warnings=tuple(doubt),
        parts=(Part("Before the run", (table,)), Part("The rig", (rig_table(rig),))),
        numbers={"chance": supported(predicted.share), "interval": supported((low, high)),
                 "words": dict(predicted.words), "quiet_chance": supported(predicted.quiet_share),
                 "rest_rms_95": predicted.rest_rms, "tilt": predicted.tilt,
                 "push": predicted.push, "noise": predicted.noise, "draws": draws, "seed": seed},
    )  # fmt: skip
    return Answer(predicted, resting_on(chapter, known.basis, SIMULATED))


def _of_design(designed: Designed, rig: Rig, own: Sequence[str]) -> Law:
    """The law of a design, which has to be for this rig as it runs."""
    if own:
        raise BadInput(f"a design has its own velocities; leave {' and '.join(own)} out, or hand over its gains.")
    if designed.request.at != "inverted":
        raise BadInput(f"chance tries what holds 'inverted', and this design is for '{designed.request.at}'.")
    if not math.isclose(designed.request.period, rig.period, rel_tol=1e-9):
        raise BadInput(
            f"this design is for a period of {1e3 * designed.request.period:g} ms, and the rig's is "
            f"{1e3 * rig.period:g} ms; design again, or pass period={designed.request.period:g}."
        )
    return replace(designed.law, target=0.0)  # a deviation from the equilibrium, as the trial has it


def _effort(preflight: Preflight) -> str:
    """What holding takes, as the end of a sentence."""
    from upright.basis import in_percent
    from upright.control.effort import QUIET_PEAK, QUIET_RMS, of_limit

    if not preflight.drawn.held.any():
        return "."
    if preflight.quiet_share > 0.95:
        return f"; on 95 % of those the command at rest has an rms of {of_limit(preflight.rest_rms, 'at most ')}."
    return (
        f". Only {in_percent(preflight.quiet_share)} settle with a command that is quiet at rest: its rms reaches "
        f"{of_limit(preflight.rest_rms)} ({100 * QUIET_RMS:.0f} % is quiet) and its peak "
        f"{100 * float(preflight.drawn.rest_peak[preflight.drawn.held].max()):.0f} % ({100 * QUIET_PEAK:.0f} %)."
    )
