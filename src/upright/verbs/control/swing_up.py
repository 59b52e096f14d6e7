"""Encoders checked, the pendulum swung up and caught: `swing_up`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Unpack

from upright.errors import BadInput, nearest
from upright.files import keeps_its_inputs
from upright.renamed import LIE, renamed
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.handover import called, rig_of
from upright.verbs.options import FIT, TravelOptions, above_zero, as_typed, known_options, rig_entries, vendor_of
from upright.verbs.pages import page_folder, write_page, written_where_named
from upright.verbs.values import open_log

if TYPE_CHECKING:
    from upright.control.sensors import Scales
    from upright.experiments.swing_up_2b.run import SwingUpRun
    from upright.files import PathLike
    from upright.rig import Rig
    from upright.verbs.forms import RigLike
    from upright.verbs.values import Log


@command(
    "Control",
    defaults={"out": "swing-up"},
    metavars={"source": "[FIT]", "fault": "NAME=FACTOR", "check": "LOG"},
    helps={
        "source": FIT + "the law is designed from it, else from the data sheet.",
        "fault": 'A faulty encoder, which shows FACTOR times the true value: "theta=2".',
    },
    names={"fault": "--fault --lie"},
    ranges={"seconds": (1.0, 120.0)},
    wrong=lambda answer: not answer.value.sound,  # whatever its model is worth
    more="""
    upright swing-up --rig linear --seed 3

    With your own rig: drive it from rest, hanging, until it swings to 60 degrees or
    more, let it coast, and have its encoders checked (columns u, theta, psi or x).

    upright swing-up out/fit.json --check swings.csv
    """,
)
@renamed(LIE)
@written_where_named
@keeps_its_inputs
def swing_up(
    source: RigLike | None = None, *, rig: str | None = None, seed: int = 1, seconds: float = 12.0,
    fault: str | Mapping[str, float] | None = None,
    check: Log | None = None, out: PathLike | None = None, pdf: bool = False,
    **on: Unpack[TravelOptions],
) -> Answer[SwingUpRun | Scales]:  # fmt: skip
    """Swing a hanging pendulum up by its own drive and catch it, once its encoders are trusted.

    The swing-up stays within the drive's limit and travel. The law is designed from a fit, or from the rig model's data
    sheet, and runs on a twin with different true parameters. `upright show`, `identify` and `predict` read its logs.

    Parameters
    ----------
    source : fit, path or plant, optional
        Fit that the law is designed from, or its fit.json; the rig model's data sheet when omitted.
    rig : str, optional
        Rig model, furuta or linear; with a fit, the one whose vendor is chosen.
    seed : int
        Random seed of the rig model, 0 is nominal; where no vendor is named, of the rig drawn from the fit's
        covariance.
    seconds : float
        Time to swing up and hold, 1 to 120 s.
    fault : str or mapping, optional
        A faulty encoder, which shows a multiple of the true value: ``{"theta": 2}``.
    check : path, Record or pandas.DataFrame, optional
        Check the encoders only, on this log of a hanging, driven rig.
    out : path, optional
        Folder for all files; in Python none is written without one.
    pdf : bool
        Write the page as PDF too.
    **on
        Of the rig: limit, period, counts, vendor, travel; see `TravelOptions`.

    Returns
    -------
    Answer
        Of a `SwingUpRun`, which says whether it was `caught`; of the encoders' `Scales` when only they are checked.

    Raises
    ------
    BadInput
        When the call contradicts itself or the fit, or the log cannot be used.
    """
    from upright.experiments.stand.twin import TwinStand
    from upright.experiments.swing_up_2b.chapter import chapter, check_chapter
    from upright.experiments.swing_up_2b.run import known_of, run_swing_up, scales_of_log
    from upright.files import write_json
    from upright.report.symbols import typed
    from upright.rig.completion import completed, doubts, twin_of
    from upright.rig.hardware import driven_unit
    from upright.rig.makes import make_rig

    at, on = page_folder(out, pdf), known_options(TravelOptions, on, "swing_up")
    if not 1 <= seconds <= 120:
        raise BadInput(f"--seconds needs a time from 1 to 120 s, got {seconds:g}.")
    known, doubt = None, ()
    if source is None:
        for option in on.keys() - {"travel"}:
            raise BadInput(f"--{option} is for a rig of your own: name its fit.json first.")
        model, truth = make_rig(rig or "furuta"), make_rig(rig or "furuta", seed)
    else:
        identified = rig_of(source, "swing_up", seed=seed)
        known, on["vendor"] = known_of(identified), vendor_of(identified, rig or "", on, called(source))
        entries = rig_entries(identified.plant, identified.unit, on)
        needs = ("limit", "servo_period", "counts", "travel")
        model = completed(identified, entries, vendor=on.get("vendor"), needs=needs, who="swing-up")
        described = check is not None or not (model.draws or model.hardware.vendor)
        truth = model if described else twin_of(model, seed)
        doubt = doubts(identified, model, None if described else truth)
        if described and check is None:
            doubt = (*doubt, "Nothing says what else the rig may be, so the law meets the numbers it was made from.")
    name = "" if source is None else called(source) + as_typed(on)
    if check is not None:
        record, log = open_log(check)
        scales = scales_of_log(model, record, known)
        page = check_chapter(model, scales, log.name, name or "FIT.json")
        page = replace(page, warnings=(*page.warnings, *doubt))
        return Answer(scales, page, write_page(page, at / "encoders.html", pdf))
    travel, stand = above_zero(on, "travel", driven_unit(type(model.plant))), TwinStand(rig=_faulty(truth, fault))
    result = run_swing_up(model, stand, at, known=known, seconds=seconds, travel=travel, source=name)
    page = chapter(result, typed(at))
    page = replace(page, warnings=(*page.warnings, *doubt))
    return Answer(
        result, page, [*write_page(page, at / "swing_up.html", pdf), write_json(at / "swing_up.json", page.numbers)]
    )


def _faulty(rig: Rig, fault: str | Mapping[str, float] | None) -> Rig:
    """The rig with one encoder that shows a multiple of what is true."""
    if isinstance(fault, str):
        faults = [(name.strip(), value.strip()) for name, _, value in [fault.partition("=")] if fault.strip()]
    else:
        faults = [(name, str(value)) for name, value in (fault or {}).items()]
    names = [c.name for c in rig.plant.coordinates]
    factors = dict.fromkeys(names, 1.0)
    for name, value in faults:
        if name not in names:
            raise BadInput(f"--fault names a coordinate as in \"theta=2\", got '{name}'; {nearest(name, names)}")
        try:
            factor = float(value)
        except ValueError:
            factor = 0.0
        if not 0.01 <= abs(factor) <= 100:
            raise BadInput(
                f"--fault needs a factor between 0.01 and 100, or negative for swapped channels, got '{value}'."
            )
        factors[name] = factor
    return replace(rig, scales=tuple(factors.values())) if faults else rig
