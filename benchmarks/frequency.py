"""Does experiment 1b find the pole by which a pendulum falls? 50 seeded twins of each kind, 28 sines each, hanging.

Rigs differ by 1 to 4 %, friction by 14 %; what the bench says about the pendulum is off by its tolerance. Asked: the
unstable pole of the inverted rig within 1 %, and inside its 95 % interval.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.measure import Line, of_each


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """Errors of the pole by least squares and by the paper's simplex, and how often intervals hold."""
    from upright.experiments.frequency_1b.chapter import true_key
    from upright.experiments.frequency_1b.run import run_frequency
    from upright.identification.frequency.answer import key_value
    from upright.rig.makes import PENDULUMS

    lines: list[Line] = []
    seeds = range(1, 2 if quick else 51)
    with tempfile.TemporaryDirectory() as folder:
        for make in PENDULUMS:
            run_frequency(make, 0, Path(folder))  # compiles
            progress(make)
            runs, each = of_each(lambda seed, make=make: run_frequency(make, seed, Path(folder)), seeds)
            off, walked, held, numbers, cost = [], [], [], [], []
            for done in runs:
                answer, truth = done.answer, true_key(done)
                found = key_value(answer.key)
                off.append(abs(found.value / truth - 1))
                walked.append(abs(answer.simplex_pole.real / truth - 1))
                held.append(found.interval[0] <= truth <= found.interval[1])
                numbers += [e.interval[0] <= done.truth[n] <= e.interval[1] for n, e in answer.fit.estimates.items()]
                cost.append((answer.squares.way.seconds, answer.simplex.seconds))
            least, simplex = np.median(np.array(cost), axis=0)
            lines.append(
                Line(
                    contender=f"{make}, least squares", seconds=each,
                    error=float(np.median(off)),
                    note=f"unstable pole inside {100 * np.mean(held):.0f} % of the 95 % intervals of {len(seeds)}"
                    f" twins, all numbers inside {100 * np.mean(numbers):.0f} %; worst error {max(off):.2g}; asked:"
                    f" 0.01; fit {least:.2g} s",
                )
            )  # fmt: skip
            lines.append(
                Line(
                    contender=f"{make}, simplex on dB", error=float(np.median(walked)),
                    note=f"the paper's way, dry friction taken for viscous; worst error {max(walked):.2g};"
                    f" fit {simplex:.2g} s",
                )
            )  # fmt: skip
    return lines
