"""Which masses should be bolted on, where, and how often?"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from upright.cli.terminal import tell
from upright.errors import BadInput, nearest
from upright.report.page import Chapter, Part, Step, Table

if TYPE_CHECKING:
    from upright.identification.loadings import Loading, Plan

FLAT = 0.1
"""A run more is worth it while it tightens the stiffness by this share."""


def plan_inertias(
    rig: Annotated[str, typer.Option(metavar="KIND", help="rectilinear (carts) or torsional (disks).")] = "rectilinear",
    bare: Annotated[str, typer.Option(help="Bare inertia, roughly; 0.77 kg or 3e-3 kg m^2 if left out.")] = "",
    error: Annotated[
        str, typer.Option(help="Standard error of a frequency from one run, as it was measured.")
    ] = "0.2 %",
    tolerance: Annotated[str, typer.Option(help="Standard uncertainty of one added mass or inertia.")] = "0.2 %",
    runs: Annotated[int, typer.Option(min=2, max=16, help="Most runs to be planned.")] = 10,
    levels: Annotated[int, typer.Option(min=2, max=5, help="Different loadings at least.")] = 3,
    radius: Annotated[
        list[str] | None, typer.Option(metavar="LENGTH", help="Bolt circle of a disk, once for each; 2 to 9 cm.")
    ] = None,
    target: Annotated[str, typer.Option(help="Standard error of the stiffness that would do, such as '0.3 %'.")] = "",
    out: Annotated[Path | None, typer.Option("-o", "--out", metavar="FILE", help="Picture to draw (SVG, PNG).")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the plans as JSON instead of a table.")] = False,
) -> None:
    """Say which masses give the tightest stiffness for the fewest runs of experiment 1a.

    Carts take 0, 0.5, 1, 1.5 or 2 kg; disks take none, two or four masses of 500 g on any bolt circle, so that they
    stay balanced. Every design is compared on the line 1/omega_n^2 = (m_0 + a)/k.

    upright plan-inertias --rig torsional --error "0.3 %" --radius "4 cm" --radius "9 cm"
    """
    from upright.experiments.makes import OSCILLATORS
    from upright.identification.loadings import plan_loadings
    from upright.units import parse

    if rig not in OSCILLATORS:
        raise BadInput(f"--rig is {' or '.join(OSCILLATORS)}, got '{rig}'; {nearest(rig, OSCILLATORS)}")
    choice, body = loadings(rig, radius), OSCILLATORS[rig]
    m_0 = parse(bare, body.unit) if bare else body.plant.parameters()[body.inertia]
    piece = min(w.added for w in choice if w.added > 0)
    piece = piece / 2 if rig == "torsional" else piece
    e, g = _share(error, "--error"), _share(tolerance, "--tolerance")
    if runs < levels:
        raise BadInput(f"--runs needs at least as many as --levels, got {runs} for {levels}; plan more runs.")
    plans = {
        n: plan_loadings(choice, n, bare=m_0, error=e, tolerance=g, piece=piece, levels=levels)
        for n in range(levels, runs + 1)
    }
    wanted = _share(target, "--target") if target else None
    chosen = choose({n: p[0].k for n, p in plans.items()}, wanted)
    if out is not None:
        from upright.experiments.weighing_1a.figures import plan_figure
        from upright.report.drawing import save

        save(plan_figure(plans, chosen), out)
    numbers = _as_json(plans, chosen, body.unit) if as_json else None
    tell(chapter(plans, chosen, wanted, body.unit), [] if out is None else [out], numbers)


def loadings(rig: str, radius: list[str] | None) -> list[Loading]:
    """What can be added to a cart, or to a disk on the bolt circles given."""
    from upright.experiments.makes import MASS_RADIUS
    from upright.identification.loadings import Loading
    from upright.physics.oscillators import added_inertia, added_mass
    from upright.units import parse

    if rig == "rectilinear":
        if radius:
            raise BadInput(
                "--radius is for disks; a cart takes its masses anywhere. Leave it out or say --rig torsional."
            )
        return [Loading(label=f"{added_mass(n):g} kg", added=added_mass(n)) for n in range(5)]
    circles = [parse(r, "m") for r in radius] if radius else [0.01 * cm for cm in range(2, 10)]
    out = [Loading(label="none", added=0.0)]
    for n in (2, 4):
        for r in circles:
            out.append(Loading(label=f"{n} at {100 * r:g} cm", added=added_inertia(n, r, mass_radius=MASS_RADIUS)))
    return out


def choose(k: dict[int, float], wanted: float | None) -> int:
    """Runs: the fewest that reach what is wanted, else the last that is worth its while."""
    if wanted is not None:
        return next((n for n in sorted(k) if k[n] <= wanted), max(k))
    numbers = sorted(k)
    for n, more in pairwise(numbers):
        if k[more] > (1 - FLAT) * k[n]:
            return n
    return numbers[-1]


def _share(text: str, option: str) -> float:
    from upright.units import parse

    value = parse(text, "1")
    if not 0 <= value < 0.5:
        raise BadInput(f"{option} needs a share between 0 and 50 %, got '{text}'; write it as '0.2 %'.")
    return value


def _spelt(plan: Plan) -> str:
    """A plan in words: ``2x none, 3x 2 kg``."""
    return ", ".join(f"{n}× {w.label}" for w, n in zip(plan.loadings, plan.runs, strict=True))


def _as_json(plans: dict[int, tuple[Plan, Plan]], chosen: int, unit: str) -> dict[str, Any]:
    def one(plan: Plan) -> dict[str, Any]:
        rows = [
            {"loading": w.label, "added": w.added, "runs": n} for w, n in zip(plan.loadings, plan.runs, strict=True)
        ]
        return {"runs": rows, "k": plan.k, "bare": plan.bare}

    return {
        "unit": unit,
        "chosen": chosen,
        "plans": {str(n): {"stiffness": one(c), "both": one(d)} for n, (c, d) in plans.items()},
    }


def chapter(plans: dict[int, tuple[Plan, Plan]], chosen: int, wanted: float | None, unit: str) -> Chapter:
    """The best plan for every number of runs, and the one to take."""
    rows = tuple(
        (
            f"{n}{' *' if n == chosen else ''}", *(
                cell for p in both for cell in (_spelt(p), f"{100 * p.k:.2f} %", f"{100 * p.bare:.2f} %")
            ),
        )
        for n, both in plans.items()
    )  # fmt: skip
    table = Table(
        caption="Standard errors of stiffness k and bare inertia m_0, relative",
        headings=("runs", "for the stiffness", "k", "m_0", "for both together", "k", "m_0"), rows=rows,
        numbers=(0, 2, 3, 5, 6),
    )  # fmt: skip
    c = plans[chosen][0]
    if wanted is not None and c.k > wanted:
        reason = f"No plan up to {chosen} runs reaches {100 * wanted:.2g} %; the best is"
    elif wanted is not None:
        reason = f"The fewest runs that reach {100 * wanted:.2g} %:"
    else:
        reason = f"One more run would tighten the stiffness by less than {100 * FLAT:.0f} %:"
        if chosen == max(plans):
            reason = "Every run planned is still worth its while:"
    onward = Step(
        "Run them, log each step, and weigh the rig with the logs.",
        f'upright loadings bare.csv heavy.csv --added "0 {unit}" --added "{c.loadings[-1].label}"',
    )
    return Chapter(
        title="Which loadings to run", verdict=f"{reason} {_spelt(c)}; k to {100 * c.k:.2f} % (*).", steps=(onward,),
        parts=(Part("Best plan for every number of runs", (table,)),),
    )  # fmt: skip
