"""Does a rig with unchecked wiring come upright in a minute, or is the fault named?

Twins of a Furuta pendulum and of a pendulum on a cart, each with parameters of its own, get random wiring faults: motor
leads swapped, channels of an encoder swapped, counts other than described, a supply at 40 to 60 %. A fifth have none, a
third have two. Each is run by `upright lab --rig RIG.toml --quick`, which knows what its maker's data sheet says.

With correct wiring the right answer is a rig that is upright at the end, and a weak supply named where there is one.
With a fault it is no closed loop and every fault named. Of drive, body and pendulum, two reversed are the third one
reversed, seen in a mirror, and all three reversed are none; they count so. Travel is the true motion of the driven
body, not what its encoder showed. Counts that are 2.4 % off (1024 for 1000) need not be noticed: a loop tolerates them.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.measure import Line, Target, of_each, page
from upright.errors import UprightError
from upright.experiments.quick.run import QuickRun, run_quick
from upright.experiments.stand.live import live_stand
from upright.logs import read_log
from upright.workers import HERE, Workers

MAKES = {"furuta": ("psi", "theta"), "linear": ("x", "theta")}
TWINS, QUICK = 100, 2
LEAST = 95
COUNTED = (0.25, 0.5, 2000 / 4096, 1024 / 1000, 2.0, 4.0)
"""Counts over those described: edges counted otherwise, another disk."""
NAMED = 0.04
"""How far named counts may be from the true ones, as a share: 1000 and 1024 are 2.4 % apart."""


@dataclass(frozen=True, kw_only=True)
class Minute:
    """What became of a twin."""

    make: str
    seed: int
    faults: Mapping[str, float]
    right: bool
    upright: bool
    said: str
    went: float
    seconds: float


def drawn(seed: int) -> tuple[str, dict[str, float]]:
    """Make and faults of a twin."""
    rng = np.random.default_rng([seed, 2211])
    make = list(MAKES)[seed % 2]
    body, pendulum = MAKES[make]
    faults = dict[str, float]()
    number = int(rng.choice([0, 1, 1, 1, 2, 2])) if rng.random() > 0.05 else 0
    for kind in rng.choice(["leads", "body", "pendulum", "counts of body", "counts", "supply"], number, replace=False):
        if kind == "leads":
            faults["drive"] = -faults.get("drive", 1.0)
        elif kind == "supply":
            faults["drive"] = faults.get("drive", 1.0) * float(rng.uniform(0.4, 0.6))
        else:
            name = body if "body" in str(kind) else pendulum
            factor = float(rng.choice(COUNTED)) if "counts" in str(kind) else -1.0
            faults[name] = faults.get(name, 1.0) * factor
    return make, faults


def minute(seed: int) -> Minute:
    """A twin put to the test."""
    make, faults = drawn(seed)
    with tempfile.TemporaryDirectory(prefix="upright-quick-lab-") as name:
        folder = Path(name)
        board = "".join(f"{n} = {factor!r}\n" for n, factor in faults.items())
        board = f"[board]\n{board}" if faults else ""
        text = f'kind = "twin"\nmake = "{make}"\nseed = {seed + 1}\n{board}'
        (folder / "RIG.toml").write_text(text, encoding="utf-8")
        stand, result, said = live_stand(folder / "RIG.toml"), None, ""
        try:
            result = run_quick(stand, folder / "out")
            said = "; ".join(s for s in (result.refused, result.wiring.weak, result.ended) if s)
        except UprightError as error:
            said = str(error)
        body = MAKES[make][0]
        logs = [read_log(path) for path in sorted((folder / "out").glob("*.mcap"))]
        went = max((float(np.abs(log.columns[body]).max()) for log in logs if len(log)), default=0.0)
        return Minute(
            make=make, seed=seed, faults=faults, right=result is not None and named_right(make, faults, result),
            upright=result is not None and result.upright, said=said or "upright",
            went=went / abs(faults.get(body, 1.0)) / stand.travel,
            seconds=math.nan if result is None else result.seconds,
        )  # fmt: skip


def named_right(make: str, faults: Mapping[str, float], result: QuickRun) -> bool:
    """Whether it came upright where it should, or every fault is named and nothing else."""
    body, pendulum = MAKES[make]
    drive = faults.get("drive", 1.0)
    weak = bool(result.wiring.weak) == (abs(drive) < 1.0)
    turned = [s * np.sign(f) for s, f in ((1, drive), (1, faults.get(body, 1.0)), (1, faults.get(pendulum, 1.0)))]
    if sum(turned) < 0:  # the same, seen in a mirror
        turned = [-t for t in turned]
    names = ("motor leads swapped", f"encoder channels of {body} swapped", f"encoder channels of {pendulum} swapped")
    expected = {name for name, t in zip(names, turned, strict=True) if t < 0}
    counted = {n: abs(f) for n, f in faults.items() if n != "drive" and abs(abs(f) - 1.0) > 0.03}
    wrong = [what for what, _ in result.wiring.wrong]
    named = {w.partition(":")[0]: w for w in wrong if "counts per" in w}
    described = dict(zip(MAKES[make], result.wiring.described, strict=True))
    for name, factor in counted.items():
        words = named.pop(name, "").partition(" not ")[0].replace(",", " ").split()
        numbers = [float(w) for w in words if w.isdigit()]
        if not any(abs(n / (abs(described[name]) * factor) - 1.0) < NAMED for n in numbers):
            return False
    if named or {w for w in wrong if "counts per" not in w} != expected or not weak:
        return False
    return bool(wrong) or result.upright


def run(
    *, quick: bool, progress: Callable[[str], None], workers: Workers = HERE, markdown: Path | None = None
) -> list[Line]:  # fmt: skip
    """All twins; reached when enough came out right, and none left its travel."""
    seeds = range(QUICK if quick else TWINS)
    progress(f"{len(seeds)} twins")
    minutes, _ = of_each(minute, list(seeds), workers)
    lines = _lines(minutes)
    if markdown is not None:
        result = headline(sum(m.right for m in minutes), len(minutes), sum(m.went > 1.0 for m in minutes))
        text = page("quick_lab", "A minute at a rig", __doc__, _table(minutes, lines), result)
        markdown.write_text(text, encoding="utf-8")
    return lines


def headline(right: int, twins: int, beyond: int) -> str:
    """The result in a sentence."""
    return (
        f"{right} of {twins} twins came upright or had every fault named ({LEAST} required), and {beyond or 'none'} "
        f"went beyond {'their' if beyond > 1 else 'its'} travel."
    )


def _lines(minutes: list[Minute]) -> list[Line]:
    right, stood = sum(m.right for m in minutes), sum(m.upright for m in minutes)
    beyond, longest = sum(m.went > 1.0 for m in minutes), max(m.seconds for m in minutes if m.seconds == m.seconds)
    miss = 1 - right / len(minutes)
    return [
        Line(
            contender="neither upright nor refused with the right cause", ratio=(miss, miss, miss),
            target=Target(most=1 - LEAST / TWINS),
            note=f"{right} of {len(minutes)} right: {stood} upright; longest {longest:.0f} s at the rig",
        ),
        Line(
            contender="beyond the travel", ratio=(beyond / len(minutes),) * 3, target=Target(most=0.0),
            note=f"{beyond} of {len(minutes)}; the farthest {max(m.went for m in minutes):.0%} of it",
        ),
    ]  # fmt: skip


def _table(minutes: list[Minute], lines: list[Line]) -> list[str]:
    out = ["", *(f"- {line.contender}: {line.note}." for line in lines), ""]
    out += ["| twin | faults | what was said | farthest, of the travel | right |", "|---|---|---|---|---|"]
    for m in minutes:
        faults = ", ".join(f"{n} × {f:.4g}" for n, f in m.faults.items()) or "none"
        out.append(f"| {m.make} {m.seed} | {faults} | {m.said} | {m.went:.0%} | {'yes' if m.right else '**no**'} |")
    return out
