"""A rig that moves in a page, beside the rigs that its fit allows: `play`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Unpack

from upright.files import keeps_its_inputs
from upright.verbs.command import command
from upright.verbs.control.moving import Played, played, played_run
from upright.verbs.handover import rig_of
from upright.verbs.options import TrialOptions, known_options

if TYPE_CHECKING:
    from upright.files import PathLike
    from upright.verbs.forms import RigLike, StudyLike


@command(
    "Control",
    metavars={"fit": "FIT", "poles": "LIST", "start": "LIST", "log": "LOG", "out": "PAGE"},
    helps={"fit": "fit.json, its folder, or a study (TOML).", "out": "The page."},
    defaults={"out": "play.html"},
    more="""
    upright play out/fit.json -o play.html
    upright play out/fit.json --poles "-4.15+-1.63j, -16.9, -3.2" --limit "5 V"
    upright play out/fit.json --log other_day.csv -o run.html
    """,
)
@keeps_its_inputs
def play(
    fit: RigLike, *, poles: str | Iterable[complex] | None = None, seed: int = 0, log: StudyLike | None = None,
    out: PathLike | None = None, **on: Unpack[TrialOptions],
) -> Played:  # fmt: skip
    """Write a page with a live twin: push it, drag its poles, see which rigs of the fit are stabilised.

    The rig is simulated in the page, with dry friction, delay, encoder counts and limit; the page works offline. Rigs
    drawn from the fit's covariance run beside it under the same law, again at every change.

    Parameters
    ----------
    fit : answer of `identify`, path, study, rig or plant
        Of a rig with an inverted equilibrium and one drive.
    poles : str or sequence of complex
        Closed-loop poles to begin with [1/s]; proposed as by `design` when omitted.
    seed : int
        Random seed of the rigs drawn from the fit's covariance.
    log : path, Record or pandas.DataFrame, optional
        Log of a run to play in the page, measured and predicted, with a slider for time.
    out : path, optional
        Where the page is written, a file ending in .html; nowhere when omitted, and a notebook shows it.
    **on
        Of the trial, start, seconds, draws; of the rig and its loop, limit, period, counts, vendor, travel, speed,
        memory; see `TrialOptions`.

    Returns
    -------
    Played
        With the `Scores` of the rigs, as `chance` has them for the same draw; `page` is its mark-up.

    Raises
    ------
    BadInput
        When something of the rig is not known, or it cannot be drawn or compiled for a page.
    """
    if log is not None:
        from upright.verbs.handover import fitted_of
        from upright.verbs.model.predict import predict

        stored = fitted_of(fit, "play")
        label, score = next(iter(predict(stored, log).value.items()))
        return played_run(score, stored.rig().plant, label, out)
    on = known_options(TrialOptions, on, "play")
    known = rig_of(fit, "play", seed=seed, draws=on.get("draws", 200))
    return played(known, poles=poles, seed=seed, out=out, **on)
