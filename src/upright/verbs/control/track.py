"""A step through a flexible shaft: `track`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

from upright.errors import BadInput
from upright.files import keeps_its_inputs
from upright.progress import Progress, silent
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.handover import called, rig_of
from upright.verbs.options import RigOptions, above_zero, known_options, rig_entries
from upright.verbs.pages import page_folder, write_page, written_where_named
from upright.verbs.values import read_pole_list, si_if_given

if TYPE_CHECKING:
    from upright.experiments.tracking_3.run import Tracking
    from upright.files import PathLike
    from upright.verbs.forms import RigLike

_poles = read_pole_list  # the verbs have options of this name


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
    },
    more="""
    upright track --rig torsional --seed 3 -o out
    upright track out/fit.json --set 4 --step "6 mm"
    """,
)
@written_where_named
@keeps_its_inputs
def track(
    source: RigLike | None = None, *, rig: str = "rectilinear", seed: int = 0,
    sets: str | int | Sequence[int] | None = None, poles: str | Iterable[complex] | None = None,
    step: float | str | None = None,
    out: PathLike | None = None, pdf: bool = False, progress: Progress = silent,
    **on: Unpack[RigOptions],
) -> Answer[Tracking]:  # fmt: skip
    """Step the far end of a flexible shaft, by state feedback and by PD.

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
        Random seed of the rig model; 0 is nominal.
    sets : str, int or sequence of int, optional
        Sets of Table 2, the command line's ``--set``; all when neither they nor poles are given.
    poles : str or sequence of complex, optional
        Poles of one's own [1/s].
    step : float or str, optional
        Size of the step [m or rad]; chosen by effort, twist and travel when omitted.
    out : path, optional
        Folder for all files; in Python none is written without one.
    pdf : bool
        Write the page as PDF too.
    progress : callable, optional
        Called with the current step and the share completed.
    **on
        Of the rig: limit, and of a rig of your own period, counts, vendor; see `RigOptions`.

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
    from upright.experiments.tracking_3.run import run_tracking, track_on
    from upright.files import write_json
    from upright.rig.completion import completed, doubts
    from upright.rig.makes import SHAFTS, make_rig

    at, options = page_folder(out, pdf), known_options(RigOptions, on, "track")
    own = _poles(poles)
    which = _sets(sets) or (() if own is not None else (1, 2, 3, 4))
    if source is None and rig not in SHAFTS:
        raise BadInput(f"--rig is {' or '.join(SHAFTS)}, got '{rig}'.")
    doubt: tuple[str, ...] = ()
    if source is None:
        model = make_rig(rig, seed)
    else:
        known = rig_of(source, "track")
        shaft_make(known.plant, f"'{known.name}'")
        entries, vendor = rig_entries(known.plant, known.unit, options), options.get("vendor")
        model = rig_of_file(completed(known, entries, vendor=vendor, who="track"), Path(called(source)).name)
        doubt = doubts(known, model)
    size = si_if_given(step, model.plant.coordinates[-1].unit)
    if size is not None and not size > 0:
        raise BadInput(f"--step needs a size above 0, got '{step}'.")
    if source is None:
        model = model.replace(limit=above_zero(options, "limit", model.unit) or model.limit)
        result = run_tracking(model, seed, at, progress, which=which, poles=own, step=size)
    else:
        result = track_on(model, None, Path(called(source)), None, None, progress, which=which, poles=own, step=size)
    page = chapter(result)
    page = replace(
        page, title=f"Experiment 3: {page.title.lower()}, {result.rig.name}",
        numbers={**page.numbers, "verdict": page.verdict}, warnings=(*page.warnings, *doubt),
    )  # fmt: skip
    return Answer(
        result, page, [write_json(at / "track.json", page.numbers), *write_page(page, at / "track.html", pdf)]
    )


def _sets(sets: str | int | Sequence[int] | None) -> tuple[int, ...]:
    if sets is None:
        return ()
    if isinstance(sets, int):
        return (sets,)
    if not isinstance(sets, str):
        return tuple(sets)
    try:
        return tuple(int(part) for part in sets.split(",")) if sets else ()
    except ValueError:
        raise BadInput(f'--set takes numbers of Table 2 separated by commas, as in "1,4", got {sets[:40]!r}.') from None
