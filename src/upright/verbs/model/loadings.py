"""Stiffness and bare inertia from steps with added masses: `loadings`, and the plan of them: `plan_inertias`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from upright.errors import BadInput, nearest
from upright.files import keeps_its_inputs
from upright.renamed import renamed
from upright.verbs.answer import Answer
from upright.verbs.command import command
from upright.verbs.pages import folder_if_given, write_page
from upright.verbs.values import open_log, paths, si, texts

if TYPE_CHECKING:
    from upright.files import PathLike
    from upright.identification.loadings import Loadings, Plan
    from upright.verbs.values import Log


_MOST = 1e6  # kg or kg m^2


@command(
    "Model",
    metavars={"added": "INERTIA", "signal": "COLUMN", "rig": "KIND"},
    names={"rig": "--rig --twin"},
    helps={"added": "What was added, log by log: '1.5 kg', '4e-3 kg m^2', or '2 at 6.5 cm' (500 g each)."},
    defaults={"out": "loadings"},
    more="""
    upright loadings --rig rectilinear -o out
    upright loadings bare.csv one.csv two.csv --added "0 kg" --added "0.5 kg" --added "1 kg" --signal x --command u
    """,
)
@renamed({"twin": ("rig", lambda value: value)})
@keeps_its_inputs
def loadings(
    logs: Sequence[Log] | Log | None = None, *, added: Sequence[str] | str | None = None, signal: str | None = None,
    command: str | None = None, tolerance: float | str = "0 %", free: bool = False, rig: str | None = None,
    seed: int = 0, out: PathLike | None = None, pdf: bool = False,
) -> Answer[Loadings]:  # fmt: skip
    """Find stiffness and bare inertia from step responses with known added masses.

    This is experiment 1a. Each swing gives a damped period, and its extremes viscous and dry friction; 1/omega_n^2 over
    the added inertia is a line whose slope is 1/k.

    Parameters
    ----------
    logs : path, Record, pandas.DataFrame, or a list of them
        One log of steps for each loading; repeats welcome.
    added : sequence of str
        What was added, log by log: ``"1.5 kg"``, ``"4e-3 kg m^2"``, or ``"2 at 6.5 cm"`` (500 g each).
    signal : str, optional
        Column of the position, in any unit.
    command : str, optional
        Column of the command that steps.
    tolerance : float or str
        Standard uncertainty of one added piece, as a share.
    free : bool
        Count swings at zero command only, with the drive silent.
    rig : str, optional
        No logs: step a twin, rectilinear or torsional.
    seed : int
        Random seed of the rig model; 0 is nominal.
    out : path, optional
        Folder for the page, and for the logs of a twin.
    pdf : bool
        Write the page as PDF too.

    Returns
    -------
    Answer
        Of `Loadings`.

    Raises
    ------
    BadInput
        When logs and loadings do not match, or a column is not named.
    NotIdentifiable
        When too few swings can be seen.
    """
    from upright.experiments.weighing_1a.from_logs import weigh_logs, weigh_twin
    from upright.report.page import simulated

    at = folder_if_given(out, pdf)
    named = paths(logs)
    if rig:
        if named or added:
            raise BadInput("--rig steps a simulated rig and takes no logs; leave out either.")
        weighed, page = weigh_twin(rig, seed, at)
        page = simulated(page)
    else:
        if not named or len(texts(added)) != len(named):
            raise BadInput(
                f"Every log needs its --added, in the same order: {len(named)} logs came with {len(texts(added))};"
                ' write --added "0 kg" for the bare one, or try --rig rectilinear.'
            )
        records = [(record, path.name) for record, path in map(open_log, named)]
        weighed, page = weigh_logs(
            records, texts(added), signal=signal or "", command=command or "", tolerance=si(tolerance, "1"), free=free
        )
    files = [] if at is None else write_page(page, at / "report.html", pdf)
    numbers = {**page.numbers, "report": str(files[0]) if files else ""}
    return Answer(weighed, replace(page, numbers=numbers), files)


@command(
    "Model",
    metavars={"rig": "KIND", "radius": "LENGTH", "out": "FILE"},
    helps={"radius": "Bolt circle of a disk, once for each; 2 to 9 cm."},
    ranges={"runs": (2, 16), "levels": (2, 5)},
    more='upright plan-inertias --rig torsional --error "0.3 %" --radius "4 cm" --radius "9 cm"',
)
@keeps_its_inputs
def plan_inertias(
    *, rig: str = "rectilinear", bare: float | str | None = None, error: float | str = "0.2 %",
    tolerance: float | str = "0.2 %", runs: int = 10, levels: int = 3,
    radius: Sequence[float | str] | float | str | None = None, target: float | str | None = None,
    out: PathLike | None = None,
) -> Answer[dict[int, tuple[Plan, Plan]]]:  # fmt: skip
    """Plan which masses to add, and how often, for the most accurate stiffness.

    The runs are those of experiment 1a. Carts take 0, 0.5, 1, 1.5 or 2 kg; disks take none, two or four masses of 500 g
    on any bolt circle, so that they stay balanced. Every design is compared on the line 1/omega_n^2 = (m_0 + a)/k.

    Parameters
    ----------
    rig : str
        rectilinear (carts) or torsional (disks).
    bare : float or str, optional
        Bare inertia, roughly [kg or kg m^2]; 0.77 kg or 3e-3 kg m^2 when omitted.
    error : float or str
        Standard error of a frequency from one run, as it was measured; a share.
    tolerance : float or str
        Standard uncertainty of one added mass or inertia; a share.
    runs : int
        Most runs to be planned, 2 to 16.
    levels : int
        Different loadings at least, 2 to 5.
    radius : float, str or a sequence of them, optional
        Bolt circles of a disk [m]; 2 to 9 cm when omitted.
    target : float or str, optional
        Standard error of the stiffness that would do; a share.
    out : path, optional
        Picture to draw (SVG, PNG).

    Returns
    -------
    Answer
        Of the best plans by number of runs: for the stiffness, and for stiffness and bare inertia together.

    Raises
    ------
    BadInput
        When there is no such rig or picture, or numbers contradict each other.
    """
    from upright.experiments.weighing_1a.plan import chapter, choices, fewest_runs
    from upright.identification.loadings import plan_loadings
    from upright.report.drawing import picture_format
    from upright.rig.makes import BODIES
    from upright.verbs.values import si_if_given

    if out is not None:
        picture_format(Path(out))  # before the work begins
    if rig not in BODIES:
        raise BadInput(f"--rig is {' or '.join(BODIES)}, got '{rig}'; {nearest(rig, BODIES)}")
    for value, option, most in ((runs, "--runs", 16), (levels, "--levels", 5)):
        if not 2 <= value <= most:
            raise BadInput(f"{option} needs a whole number from 2 to {most}, got {value}.")
    body = BODIES[rig]
    choice = choices(rig, [si(r, "m") for r in paths(radius) if not (isinstance(r, str) and not r)])
    bare_inertia = si_if_given(bare, body.unit)
    m_0 = body.rig.plant.parameters()[body.inertia] if bare_inertia is None else bare_inertia
    if not m_0 <= _MOST:
        raise BadInput(f"--bare takes the inertia of one body, up to {_MOST:g} {body.unit}, got {m_0:g}.")
    piece = min(w.added for w in choice if w.added > 0)
    piece = piece / 2 if rig == "torsional" else piece
    e, g = _share(error, "--error"), _share(tolerance, "--tolerance")
    if runs < levels:
        raise BadInput(f"--runs needs at least as many as --levels, got {runs} for {levels}; plan more runs.")
    plans = {
        n: plan_loadings(choice, n, bare=m_0, error=e, tolerance=g, piece=piece, levels=levels)
        for n in range(levels, runs + 1)
    }
    wanted = None if target is None else _share(target, "--target")
    chosen = fewest_runs({n: p[0].k for n, p in plans.items()}, wanted)
    if out is not None:
        from upright.experiments.weighing_1a.figures import plan_figure
        from upright.report.drawing import save

        save(plan_figure(plans, chosen), Path(out))
    return Answer(plans, chapter(plans, chosen, wanted, body.unit), [] if out is None else [Path(out)])


def _share(text: float | str, option: str) -> float:
    value = si(text, "1")
    if not 0 <= value < 0.5:
        raise BadInput(f"{option} needs a share between 0 and 50 %, got '{text}'; write it as '0.2 %'.")
    return value
