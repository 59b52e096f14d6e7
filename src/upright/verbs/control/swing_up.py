"""Encoders checked, the pendulum swung up and caught: `swing_up`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput, nearest
from upright.files import keeps_its_inputs
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.control.options import COUNTS, FIT, vendor_of
from upright.verbs.handover import called, rig_of
from upright.verbs.pages import page_folder, write_page, written_where_named
from upright.verbs.rig import Counts, as_typed, rig_options
from upright.verbs.values import open_log

if TYPE_CHECKING:
    from upright.control.sensors import Scales
    from upright.experiments.swing_up_2b.run import SwingUpRun
    from upright.rig import Rig
    from upright.verbs.values import Log


@command(
    "Control",
    defaults={"out": "swing-up"},
    metavars={"source": "[FIT]", "lie": "NAME=FACTOR", "check": "LOG"},
    helps={
        "source": FIT + "the law is designed from it, else from the data sheet.",
        "lie": 'An encoder shows a multiple of what is true: "theta=2".',
        "counts": COUNTS,
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
    from upright.experiments.stand.twin import TwinStand
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
        known, vendor = known_of(identified), vendor_of(identified, rig, vendor, called(source))
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
    stand = TwinStand(rig=_lying(truth, lie))
    done = run_swing_up(model, stand, at, known=known, seconds=seconds, travel=travel, source=name)
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
