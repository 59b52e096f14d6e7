"""Which masses should be bolted on, where, and how often? What can be, the plan to take, and the chapter on it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from upright.errors import BadInput
from upright.identification.loadings import Loading, Plan
from upright.physics.oscillators import added_inertia, added_mass
from upright.report.page import Chapter, Part, Step, Table
from upright.rig.makes import MASS_RADIUS, check_radius

FLAT = 0.1
"""A run more is worth it while it tightens the stiffness by this share."""


def choices(rig: str, circles: Sequence[float] = ()) -> list[Loading]:
    """What can be added to a cart, or to a disk on bolt circles of these radii [m]; 2 to 9 cm where none is given."""
    if rig == "rectilinear":
        if circles:
            raise BadInput(
                "--radius is for disks; a cart takes its masses anywhere. Leave it out or say --rig torsional."
            )
        return [Loading(label=f"{added_mass(n):g} kg", added=added_mass(n)) for n in range(5)]
    for r in circles:
        check_radius(r)
    circles = circles or [0.01 * cm for cm in range(2, 10)]
    out = [Loading(label="none", added=0.0)]
    for n in (2, 4):
        for r in circles:
            out.append(Loading(label=f"{n} at {100 * r:g} cm", added=added_inertia(n, r, mass_radius=MASS_RADIUS)))
    return out


def fewest_runs(k: dict[int, float], wanted: float | None) -> int:
    """Runs: the fewest that reach what is wanted, else the last that is worth its while."""
    if wanted is not None:
        return next((n for n in sorted(k) if k[n] <= wanted), max(k))
    numbers = sorted(k)
    for n, more in pairwise(numbers):
        if k[more] > (1 - FLAT) * k[n]:
            return n
    return numbers[-1]


def _spelt(plan: Plan) -> str:
    """A plan in words: ``2x none, 3x 2 kg``."""
    return ", ".join(f"{n}× {w.label}" for w, n in zip(plan.loadings, plan.runs, strict=True))


def _numbers(plans: dict[int, tuple[Plan, Plan]], chosen: int, unit: str) -> dict[str, Any]:
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
        numbers=_numbers(plans, chosen, unit),
        parts=(Part("Best plan for every number of runs", (table,)),),
    )  # fmt: skip
