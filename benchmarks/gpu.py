"""How long do a million closed loops take on one GPU? Those of `ensemble`, each 2 s, data there and back included."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from benchmarks import ours, problem
from benchmarks.ensemble import EARLY, rigs
from benchmarks.measure import Contender, Line, Target, compare
from upright.errors import BadInput

LOOPS, COMPARED = 1_000_000, 1_000


def apart(*, stick_slip: bool) -> float:
    """Largest distance from this processor's states, over the first loops, while both still see the same counts."""
    p, x0 = (a[:, :COMPARED] for a in rigs(friction=stick_slip))
    there, here = (
        ours.ensemble(p, x0, samples=EARLY, stick_slip=stick_slip, device=device)() for device in ("gpu", "cpu")
    )
    return float(np.abs(there - here).max())


def loops(*, stick_slip: bool) -> Contender:
    """All of them."""
    p, x0 = problem.ensemble(LOOPS)
    p = p if stick_slip else problem.without_dry_friction(p)
    return Contender(
        name="GPU, exact stick-slip" if stick_slip else "GPU, no dry friction",
        run=ours.ensemble(p, x0, samples=problem.SAMPLES, stick_slip=stick_slip, device="gpu"),
        error=lambda _: apart(stick_slip=stick_slip),
        target=Target(most=2.0, of="seconds"),
    )


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """By the clock on the wall; without a GPU, a sentence."""
    try:
        apart(stick_slip=False)
    except BadInput as reason:
        return [Line(contender="GPU", note=f"left out: {reason}")]
    builders: dict[str, Callable[[], Contender]] = {
        "GPU, no dry friction": lambda: loops(stick_slip=False),
        "GPU, exact stick-slip": lambda: loops(stick_slip=True),
    }
    return compare(builders, rounds=3 if quick else 9, clock=time.perf_counter, progress=progress)
