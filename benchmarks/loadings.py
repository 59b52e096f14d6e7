"""Does experiment 1a find stiffness and bare inertia? 100 seeded twins of each kind, five loadings, two runs each.

Rigs differ by 4 to 6 %, added pieces by their tolerance (0.2 % of a mass, 0.4 % of an inertia), friction by 13 % from
run to run; of 100 honest 95 % intervals 90 to 99 hold the truth.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.measure import Line, of_each


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """Median errors and how often the intervals hold, per kind of rig and quantity."""
    from upright.experiments.weighing_1a.run import drawn_twin, measure_body
    from upright.rig.makes import BODIES

    lines: list[Line] = []
    seeds = range(1, 3 if quick else 101)
    measure_body(drawn_twin(0, "rectilinear"))  # compiles
    for kind in BODIES:
        progress(kind)
        done, each = of_each(lambda seed, kind=kind: measure_body(drawn_twin(seed, kind)), seeds)
        pairs = [((d.loadings.k, d.on.stiffness), (d.loadings.bare, d.on.bare)) for d in done]
        errors = np.array([[abs(w.value / truth - 1) for w, truth in pair] for pair in pairs])
        held = np.array([[w.interval[0] <= truth <= w.interval[1] for w, truth in pair] for pair in pairs])
        for column, name in enumerate(("stiffness", "bare inertia")):
            middle, share = float(np.median(errors[:, column])), 100 * held[:, column].mean()
            lines.append(
                Line(
                    contender=f"{kind}, {name}", seconds=each, error=middle,
                    note=f"truth inside {share:.0f} % of the 95 % intervals of {len(seeds)} twins;"
                    f" worst error {errors[:, column].max():.2g}; asked: 90 to 99 %, median below 1 %",
                )
            )  # fmt: skip
    return lines
