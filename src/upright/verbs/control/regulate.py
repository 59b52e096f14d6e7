"""A rig held upright, with a prediction beforehand: `regulate`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING, Unpack

from upright.errors import BadInput
from upright.files import keeps_its_inputs
from upright.progress import Progress, part, silent
from upright.renamed import CLUSTER, LET_GO, renamed
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.handover import called, rig_of
from upright.verbs.options import FIT, TrialOptions, as_typed, known_options, rig_entries, vendor_of
from upright.verbs.pages import page_folder, write_page, written_where_named
from upright.verbs.values import read_pole_list, read_start

if TYPE_CHECKING:
    from upright.experiments.regulation_2.run import Regulation, RegulationRequest
    from upright.files import PathLike
    from upright.verbs.forms import RigLike
    from upright.verbs.values import Workforce

_poles = read_pole_list  # the verbs have options of this name


@command(
    "Control",
    defaults={"out": "upright-regulate"},
    names={"which": "--set"},
    metavars={"source": "[FIT]", "rig": "MODEL", "which": "N", "start": "LIST"},
    helps={
        "source": FIT + "a twin is identified without it.",
        "which": "Pole set of Table 1, 1 to 4, or all.",
        "poles": 'Poles [1/s] of your own: "-4.15+-1.63j, -16, -3".',
        "start": 'Start of the pendulum: "12 deg" from upright, or "theta=12 deg, theta_dot=1.5 rad/s".',
    },
    ranges={"draws": (1, None)},
    more="""
    upright regulate --rig furuta --seed 3
    upright regulate out/fit.json --seed 3 --set 2 --start "20 deg"
    """,
)
@renamed({**LET_GO, **CLUSTER})
@written_where_named
@keeps_its_inputs
def regulate(
    source: RigLike | None = None, *, rig: str | None = None, seed: int | None = None, which: int | str | None = None,
    poles: str | Iterable[complex] | None = None, out: PathLike | None = None, pdf: bool = False,
    workers: Workforce = 1, progress: Progress = silent, **on: Unpack[TrialOptions],
) -> Answer[Regulation]:  # fmt: skip
    """Compare pole sets that stabilise a rig upright: the predicted probability of each, then the runs.

    Gains are placed on the numbers identified while the rig hung. Each set is simulated with limit, encoder counts,
    delay and dry friction, on rigs drawn from the fit's covariance. The laws then run on a twin; predicted and measured
    stand side by side.

    Parameters
    ----------
    source : fit, path or plant, optional
        What `identify` answered, fit.json or its folder, or a plant with its numbers; a twin is identified when
        omitted.
    rig : str, optional
        Twin to identify, furuta or linear; with a fit, the rig model whose vendor is chosen.
    seed : int, optional
        Random seed of the twin that runs: of its rig model, or, where no vendor is named, of a rig drawn from the fit's
        covariance. With a fit and no seed nothing runs.
    which : int or str, optional
        Pole set of Table 1, 1 to 4, or all; the command line's ``--set``.
    poles : str or sequence of complex, optional
        Poles of one's own [1/s].
    out : path, optional
        Folder for all files; in Python none is written without one.
    pdf : bool
        Write the page as PDF too.
    workers : int, str or executor
        Number of processes of this machine, the address of a Dask scheduler, or an executor of
        `concurrent.futures`; the numbers are the same.
    progress : callable, optional
        Called with the current step and the share completed.
    **on
        Of the trial, start, seconds, draws; of the rig and its loop, limit, period, counts, vendor, travel, speed,
        memory; see `TrialOptions`.

    Returns
    -------
    Answer
        Of a `Regulation`.

    Raises
    ------
    BadInput
        When the call contradicts itself or the fit, or poles cannot be placed.
    """
    from upright.designing.chapter import chapter as design_chapter
    from upright.experiments.regulation_2.chapter import chapter, design_of_best
    from upright.experiments.regulation_2.run import identify_make, run_regulation
    from upright.experiments.stand.twin import TwinStand
    from upright.files import write_json
    from upright.report.page import Step
    from upright.report.symbols import typed
    from upright.rig.completion import completed, doubts, twin_of
    from upright.workers import Workers

    shared = Workers.of(workers)
    at, on = page_folder(out, pdf), known_options(TrialOptions, on, "regulate")
    request, draws = _request("" if which is None else str(which), poles, on), on.get("draws", 200)
    if source is None:
        make, seed = rig or "furuta", seed or 0
        progress("identifying the hanging twin", 0.0)
        known = identify_make(make, seed, at / "identified", part(progress, 0.0, 0.6, "identifying"), draws)
        name, base = f"--rig {make}", 0.6
    else:
        known, name, base = rig_of(source, "regulate", seed=seed or 0, draws=draws), called(source), 0.0
        on["vendor"] = vendor_of(known, rig or "", on, name)
        name += as_typed(on)
    model = completed(known, rig_entries(known.plant, known.unit, on), vendor=on.get("vendor"), who="regulate")
    truth = None if seed is None else twin_of(model, seed)
    result = run_regulation(
        model, None if truth is None else TwinStand(rig=truth), seed or 0, at,
        lambda step, share: progress(step, base + (1 - base) * share), request=request,
        source=name, workers=shared,
    )  # fmt: skip
    page = chapter(result)
    if source is not None:
        page = replace(page, warnings=(*page.warnings, *doubts(known, model, truth)))
    files = write_page(page, at / "report.html", pdf)
    design = design_of_best(result)
    if design is not None:
        files.append(write_json(at / "design.json", design_chapter(design, source=name, folder=typed(at)).numbers))
        onward = Step(f"Take the law of {result.best.name} to the computer that closes the loop.",
                      f"upright export {typed(files[-1])} --to c")  # fmt: skip
        page = replace(page, steps=(onward, *page.steps))
    numbers = {**page.numbers, "verdict": page.verdict, "report": str(files[0])}
    return Answer(result, replace(page, numbers=numbers), files)


def _request(
    which: str, poles: str | Iterable[complex] | None, on: TrialOptions
) -> RegulationRequest:  # fmt: skip
    from upright.experiments.regulation_2.run import SETS, RegulationRequest
    from upright.gains.requests import read_poles

    own = _poles(poles)
    if which and own is not None:
        raise BadInput("give either --set, a set of Table 1, or --poles of your own.")
    if which not in ("", "all") and f"set {which}" not in SETS:
        raise BadInput(f"--set is 1 to {len(SETS)}, or all, got '{which}'.")
    printed = {n: read_poles(t) for n, t in SETS.items() if which in ("", "all", n[4:])}
    let_go = read_start(on.get("start"), ("theta", "theta_dot"), ("rad", "rad/s"))
    return RegulationRequest(
        poles=printed if own is None else {"your poles": own}, speed=on.get("speed") or "filtered",
        memory=on.get("memory", 0.5), seconds=on.get("seconds", 6.0), draws=on.get("draws", 200),
        tilt=let_go.get("theta"), push=let_go.get("theta_dot"),
    )  # fmt: skip
