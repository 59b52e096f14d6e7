"""Does experiment 1b find the numbers of a rig that it reaches by the protocol alone?

Twins of all makes, their dry friction among what is asked, are opened, limited, driven by probes and a multisine,
logged and fitted as `upright lab --rig RIG.toml` does with hardware. Counted are the firm numbers whose 95 % interval
holds the true one, and the fits that are trusted. The lag is left out: the twin steps twice in a period and the fit
once, which is 0.2 us of 2 ms, and the interval is narrower.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from benchmarks.measure import Line, Target, of_each
from upright.experiments.frequency_1b.at_once import run_at_once
from upright.experiments.stand.live import live_stand
from upright.rig.makes import MAKES
from upright.workers import HERE, Workers

SEEDS, QUICK = (0, 2, 5), (2,)
LEAST = 0.85
"""Share of the intervals that holds the truth, at least: 95 % of 84 less two and a half standard deviations."""


def measured(item: tuple[str, int]) -> tuple[str, bool, int, int]:
    """A twin: its make, whether its fit is trusted, how many firm numbers hold the truth, and of how many."""
    make, seed = item
    with tempfile.TemporaryDirectory(prefix="upright-at-hand-") as name:
        folder = Path(name)
        (folder / "RIG.toml").write_text(f'kind = "twin"\nmake = "{make}"\nseed = {seed}\n', encoding="utf-8")
        rig = live_stand(folder / "RIG.toml")
        fit = run_at_once(rig, folder / "1b", lambda _step, _share: None).fit
    numbers = [*rig.twin.plant.parameters(), "actuator.gain"]
    firm = [(rig.truth[n], e) for n, e in fit.estimates.items() if e.status == "well determined" and n in numbers]
    return make, fit.trusted, sum(e.interval[0] <= t <= e.interval[1] for t, e in firm), len(firm)


def run(*, quick: bool, progress: Callable[[str], None], workers: Workers = HERE) -> list[Line]:
    """A line for each make, and one for all."""
    makes = [*MAKES][: 1 if quick else None]
    twins = [(make, seed) for make in makes for seed in (QUICK if quick else SEEDS)]
    progress(f"{len(twins)} twins")
    done, _ = of_each(measured, twins, workers)
    lines = [_line(make, [d for d in done if d[0] == make]) for make in makes]
    return [*lines, _line("all", done, asked=not quick)]


def _line(name: str, done: list[tuple[str, bool, int, int]], *, asked: bool = False) -> Line:
    trusted, inside, firm = sum(d[1] for d in done), sum(d[2] for d in done), sum(d[3] for d in done)
    share = (firm - inside) / max(firm, 1)
    return Line(
        contender=f"{name}: share of firm numbers outside their interval", ratio=(share, share, share),
        target=Target(most=1 - LEAST) if asked else None,
        note=f"{inside} of {firm} firm numbers inside; {trusted} of {len(done)} fits trusted",
    )  # fmt: skip
