"""A balanced QUBE-Servo (decargroup): two episodes are fitted, the third is predicted 50 and 200 ms ahead.

The plant falls by e in 71 ms, so that no model follows it in a free run. Every prediction starts from measured angles
and speeds smoothed over 30 ms, the same for everybody. Two zeros that differ from episode to episode are refitted: that
of the pendulum's counter, and that of the command, where the cable is slack. ARX starts from the samples before.

SciPy is fitted to windows that start as those of this test do; upright estimates its own starts.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from benchmarks.peers.qube_fits import (
    AHEAD,
    ORDERS,
    Array,
    Episode,
    arx,
    episodes,
    percent,
    physical,
    with_scipy,
    with_upright,
)
from benchmarks.peers.qube_starts import explained
from benchmarks.peers.task import STUDIES, spent
from upright.study import load_study


def table(data: Path, progress: Callable[[str], None]) -> list[str]:
    """Rows of the page, and what the lead of SciPy comes of."""
    (first, second, third), known, guesses = episodes(data)
    fitted = [first, second]
    order, step = max(ORDERS, key=lambda each: sum(percent(second, arx([first], *each)(second, 0.2), 0.2)))
    numbers: dict[str, Array] = {}

    def of(name: str, p: Array) -> Callable[[Episode, float], Array]:
        numbers[name] = p
        return lambda run, seconds: physical(p, known, run, seconds)

    ways: dict[str, Callable[[], Callable[[Episode, float], Array]]] = {
        "upright": lambda: of("upright", with_upright(data)),
        "scipy least_squares": lambda: of("scipy", with_scipy(fitted, known, guesses)),
        f"ARX, {order} samples {2 * step} ms apart": lambda: arx(fitted, order, step),
        "the guesses": lambda: of("guesses", guesses),
        "the angles stay": lambda: lambda run, seconds: run.y[run.starts(round(seconds / run.dt))],
    }
    out = [f"| | {' | '.join(f'{1e3 * s:.0f} ms ahead' for s in AHEAD)} | seconds |", "|---|--:|--:|--:|"]
    for name, way in ways.items():
        progress(f"QUBE: {name}")
        begin = spent()
        predict = way()
        seconds = spent() - begin
        cells = [" / ".join(f"{p:.1f}" for p in percent(third, predict(third, s), s)) for s in AHEAD]
        out.append(f"| {name} | {' | '.join(cells)} | {seconds:.2g} |")
    progress("QUBE: the starts")
    study = load_study(STUDIES / "qube_balance.toml", data=data)
    return [*out, "", explained(study, numbers["upright"], numbers["scipy"], known, guesses, third)]
