"""How much of the motion in a log does a drafted study use, and are intervals from such a study right?

`init` drafts studies for the logs of 300 twins: 60 of each of five plants, every parameter within a factor of 1.6.

- **Motion.** Each twin is driven by steps or released by hand, once or three times. It rests for a second before that
  or moves from the first sample, and rests for a second at the end or moves to the last sample.
- **Columns.** The command's column has a name that says so, or must be recognised; a released twin has a column of
  zeros or none.
- **Noise.** White noise of 0 to 0.02 rad on angles, a hundredth of that in metres on lengths, and encoder counts.

What moves is known from the simulation: a coordinate moves when within a quarter of a second, before or after, it
passes through 2 % of its range and through more than the noise's standard deviation, with no hand on it.
Required: in 95 of 100 cases the windows of the drafted study keep 90 % of that time.

Every fifth log is then identified as drafted, with placeholders replaced by what the owner would have measured. Of n
honest intervals 95 % contain the truth, within ``1.96 sqrt(0.95 * 0.05 / n)``.
"""

from __future__ import annotations

import math
import tempfile
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.first import GAIN, Source, written
from benchmarks.measure import Line, Target, of_each, page, spread
from benchmarks.rigs import MAKES, Make, command, drawn
from upright.signals.stretches import stretches
from upright.workers import HERE, Workers

DT, REST, MOVED, LONGEST = 5e-3, 1.0, 8.0, 60.0
"""Sample period, rest, motion that is logged, and motion that is waited for until it has died away [s]."""
HAND, RELEASES = 1.0, (1.0, -0.7, 0.85)
"""How long a hand takes to bring something back and to hold it [s], and how far, as shares of the first time."""
KEPT, CASES, MOVES, WITHIN, PAUSE = 0.9, 0.95, 0.02, 0.25, 1.0
NOISE = 0.0, 0.0067, 0.0133, 0.02
EVERY = 5
"""One in so many logs is identified."""
TORQUE = 0.1
"""Of a pendulum's drive [N m], which no other benchmark drives."""
LET_GO = {"torsional-2": {"theta_2": 0.5}, "rectilinear-2": {"x_1": 0.012, "x_2": 0.02}}
"""Where a chain is let go from; the other makes have starts of their own."""
UNASKED = ("delta_", "v_", "actuator.relaxation", "actuator.delay", "actuator.lag")
"""Numbers without a truth: they do not act where what they belong to is zero, or have a bound there."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """What is logged of one twin; `place` of its make in `MAKES`."""

    place: int
    number: int
    driven: bool
    before: bool
    after: bool
    named: bool
    noise: float
    again: bool
    """Whether a hand brings what is let go back and lets it go again, twice."""

    @property
    def name(self) -> str:
        """Make and number."""
        return f"{MAKES[self.place].plant} {self.number}"


@dataclass(frozen=True, kw_only=True)
class Twin:
    """A log, its moving samples (N,), and the numbers it was made with."""

    source: Source
    moves: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Kept:
    """What became of one log: share of what moves that its study keeps, the windows, and the intervals that hold."""

    case: Case
    share: float
    said: str
    moved: float = 0.0
    """Seconds in which it moves."""
    identified: bool = False
    trusted: bool = False
    held: dict[str, bool] = field(default_factory=dict[str, bool])


def cases(each: int) -> list[Case]:
    """As many of each make, conditions and noise spread evenly over them."""
    return [
        Case(
            place=place, number=k, driven=bool(k & 1), before=bool(k & 2), after=bool(k & 4), named=bool(k & 8),
            noise=NOISE[(k // 16) % len(NOISE)], again=not k & 1 and bool((k >> 1 ^ k >> 2 ^ k >> 4) & 1),
        )
        for place in range(len(MAKES)) for k in range(each)
    ]  # fmt: skip


def twin(case: Case) -> Twin:
    """Log and truth of one case."""
    from upright.physics import find

    make = MAKES[case.place]
    generator = np.random.default_rng(70_000 + 1000 * case.place + case.number)
    plant = find(make.plant)
    numbers, _ = drawn(make, generator)
    gain = GAIN.get(make.plant, 0.1)
    loud = case.noise * _scale(make)
    clean, u, moves = _driven(case, numbers, gain, loud, generator) if case.driven else _let_go(case, numbers, loud)
    if case.before:
        rest = round(REST / DT)
        clean = np.concatenate([np.repeat(clean[:1], rest, 0), clean])
        u, moves = np.concatenate([np.zeros(rest), u]), np.concatenate([np.zeros(rest, bool), moves])
    y = np.round((clean + loud * generator.normal(size=clean.shape)) / make.resolution) * make.resolution
    columns = {c.name: (c.unit, y[:, i]) for i, c in enumerate(plant.coordinates)}
    if case.named:
        columns["u"] = ("V", u / gain)
    elif case.driven:
        columns["channel 7"] = ("", u / gain)
    truth = numbers | make.known | {"actuator.gain": gain}
    source = Source(name=case.name, t=np.arange(len(y)) * DT, columns=columns, truth=truth, plant=make.plant)
    return Twin(source=source, moves=moves)


def _moved(make: Make, numbers: dict[str, float], x0: Sequence[float], u: np.ndarray) -> np.ndarray:
    """Coordinates (N, n) of a twin that begins in a state and feels a force (N,)."""
    from upright.physics import find
    from upright.simulation import simulate

    plant = find(make.plant)(**numbers, **make.known)
    x = simulate(plant, {}, list(x0), u[:, None], DT, samples=len(u), substeps=2)
    return x[:, ::2, 0]


def _driven(
    case: Case, numbers: dict[str, float], gain: float, loud: np.ndarray, generator: np.random.Generator
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coordinates, force and where they move, from the first command on."""
    make, moved = MAKES[case.place], round(MOVED / DT)
    u = np.zeros(round(LONGEST / DT))
    u[:moved] = command(make.force or TORQUE, moved, generator)[:, 0]
    u = np.roll(u, -int(np.argmax(u != 0)))
    clean = _moved(make, numbers, [0.0] * 2 * len(make.resolution), u)
    moves = moving(clean, loud)
    samples = _end(case, moves)
    return clean[:samples], u[:samples], moves[:samples]


def _let_go(case: Case, numbers: dict[str, float], loud: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coordinates, no force, and where they move by themselves, from the first release on."""
    from upright.physics import find

    make = MAKES[case.place]
    names = [c.name for c in find(make.plant).coordinates]
    start = LET_GO.get(make.plant, make.start)
    begun = np.array([start.get(n, 0.0) for n in names])
    by_hand = np.array([n in start or make.plant in LET_GO for n in names])
    places, motions = np.zeros((0, len(names))), np.zeros(0, bool)
    sizes = RELEASES if case.again else RELEASES[:1]
    for k, size in enumerate(sizes):
        if k:
            way = np.minimum(np.arange(round(HAND / DT)) / round(HAND / DT / 2), 1.0)[:, None]
            to = np.where(by_hand, size * begun, places[-1])
            places = np.concatenate([places, (1 - way) * places[-1] + way * to])
            motions = np.concatenate([motions, np.zeros(len(way), bool)])
        at = np.where(by_hand, size * begun, places[-1] if k else begun)
        clean = _moved(make, numbers, np.stack([at, 0 * at], axis=1).ravel().tolist(), np.zeros(round(LONGEST / DT)))
        moves = moving(clean, loud)
        samples = _end(case, moves) if k + 1 == len(sizes) else int(np.flatnonzero(moves)[-1])
        places = np.concatenate([places, clean[:samples]])
        motions = np.concatenate([motions, moves[:samples]])
    return places, np.zeros(len(places)), motions


def _end(case: Case, moves: np.ndarray) -> int:
    """Sample at which a log ends: at rest, or in motion."""
    last = int(np.flatnonzero(moves)[-1])
    return min(last + round(REST / DT), len(moves)) if case.after else min(round(MOVED / DT), round(0.6 * last))


def _scale(make: Make) -> np.ndarray:
    """Of the noise of each coordinate: rad, or metres of what 1 rad is for an angle."""
    from upright.physics import find

    return np.array([1.0 if c.unit == "rad" else 0.01 for c in find(make.plant).coordinates])


def moving(clean: np.ndarray, loud: np.ndarray) -> np.ndarray:
    """Samples (N,) before and after which a coordinate (N, n) goes through more than a share of its range, and than its
    noise; where a slow swing turns is no rest."""
    width = max(2, round(WITHIN / DT))
    if len(clean) <= width:
        return np.ones(len(clean), bool)
    reach = np.ptp(np.lib.stride_tricks.sliding_window_view(clean, width, axis=0), axis=2)
    seen = (reach > np.maximum(MOVES * np.ptp(clean, axis=0), loud)).any(axis=1)
    beyond = np.ones(width - 1, bool)  # nobody sees what was before the first sample and comes after the last
    out = np.concatenate([beyond, seen]) & np.concatenate([seen, beyond])
    for first, last in stretches(out, gap=round(PAUSE / DT)):
        out[first : last + 1] = True
    return out


def share_kept(t: np.ndarray, moves: np.ndarray, windows: Sequence[tuple[float, float]]) -> float:
    """Share of the moving samples that lie in one of the windows [s]."""
    inside = np.zeros(t.size, bool)
    for first, last in windows:
        inside |= (t >= first - DT / 2) & (t <= last + DT / 2)
    return float(np.mean(inside[moves])) if moves.any() else 1.0


def met(case: Case) -> Kept:
    """What one log comes to."""
    import upright as up
    from upright.errors import UprightError

    made = twin(case)
    t = made.source.t
    with tempfile.TemporaryDirectory() as folder:
        log, study = written(made.source, "brackets", Path(folder)), Path(folder) / "study.toml"
        try:
            up.init(log, out=study, plant=made.source.plant)
        except UprightError as error:
            return Kept(case=case, share=0.0, said=str(error).splitlines()[0])
        except Exception as error:  # what a stranger must never meet
            return Kept(case=case, share=0.0, said=f"{type(error).__name__}: {error}")
        drafted = tomllib.loads(study.read_text(encoding="utf-8"))
        windows = [tuple(r["window"]) for r in drafted["runs"]]
        said = ", ".join(f"{a:.3g} to {b:.3g} s" for a, b in windows)
        spans = ", ".join(f"{t[a]:.3g} to {t[b]:.3g}" for a, b in stretches(made.moves, gap=round(1 / DT)))
        done = Kept(
            case=case, share=share_kept(t, made.moves, windows), said=f"keeps {said}; moves {spans} s",
            moved=float(made.moves.sum()) * DT,
        )  # fmt: skip
        if case.number % EVERY:
            return done
        return _identified(done, made, drafted, log)


def _identified(done: Kept, made: Twin, drafted: dict[str, Any], log: Path) -> Kept:
    import upright as up
    from upright.errors import UprightError

    truth = made.source.truth
    placeholders = {n for n, v in drafted["parameters"].items() if isinstance(v, dict) and v.get("assumed")}
    placeholders |= {
        f"actuator.{n}" for n, v in drafted.get("actuator", {}).items() if isinstance(v, dict) and v.get("assumed")
    }
    known = {n: truth[n] for n in placeholders if n in truth}
    try:
        fit = up.identify(up.read(log), made.source.plant, known=known)
    except UprightError as error:
        return _with(done, said=f"{done.said}; {str(error).splitlines()[0]}")
    usable = {n: e for n, e in fit.estimates.items() if e.status == "well determined" and not n.startswith(UNASKED)}
    held = {n: e.interval[0] <= truth.get(n, 0.0) <= e.interval[1] for n, e in usable.items()}
    return _with(done, identified=True, trusted=fit.trusted, held=held)


def _with(done: Kept, **changes: Any) -> Kept:
    from dataclasses import replace

    return replace(done, **changes)


def run(
    *, quick: bool, progress: Callable[[str], None], markdown: Path | None = None, workers: Workers = HERE
) -> list[Line]:
    """A line of each plant and condition, one of all, and one of the intervals."""
    asked = cases(4 if quick else 60)
    progress(f"{len(asked)} logs")
    done, seconds = of_each(met, asked, workers)
    if markdown is not None:
        markdown.write_text(_page(done), encoding="utf-8")
    groups = _groups(done)
    lost = 1 - enough(done)
    whole = Line(
        contender="all", seconds=seconds, rounds=len(done), note=_told(done),
        ratio=spread([lost / (1 - CASES)]), target=Target(most=1.0),
    )  # fmt: skip
    return [
        whole,
        *(Line(contender=name, note=_told(each)) for name, each in groups.items()),
        Line(contender="intervals of trusted fits", note=intervals([k for k in done if k.trusted])),
        Line(contender="intervals of the other fits", note=intervals([k for k in done if not k.trusted])),
    ]


def enough(done: Sequence[Kept]) -> float:
    """Share of the logs of which nine tenths of what moves are kept."""
    return float(np.mean([k.share >= KEPT for k in done]))


def _groups(done: Sequence[Kept]) -> dict[str, list[Kept]]:
    out: dict[str, list[Kept]] = {}
    for k in done:
        c = k.case
        motion = "driven" if c.driven else "let go thrice" if c.again else "let go once"
        first = "rests before" if c.before else "moves at once"
        last = "rests after" if c.after else "moves to the end"
        drive = "drive named" if c.named else "drive not named"
        for name in (MAKES[c.place].plant, motion, first, last, drive, f"noise {c.noise:g} rad"):
            out.setdefault(name, []).append(k)
    return out


def _told(done: Sequence[Kept]) -> str:
    shares = [k.share for k in done]
    return (
        f"{sum(s >= KEPT for s in shares)} of {len(shares)} keep nine tenths of the motion"
        f" ({100 * enough(done):.0f} %); median {100 * np.median(shares):.0f} %, least {100 * min(shares):.0f} %"
    )


def intervals(done: Sequence[Kept]) -> str:
    """How many intervals of well determined numbers hold the truth."""
    hits = [hit for k in done if k.identified for hit in k.held.values()]
    fits = sum(k.identified for k in done)
    if not hits:
        return f"{fits} fits, no well determined number"
    give = 196 * math.sqrt(0.95 * 0.05 / len(hits))
    held = 100 * float(np.mean(hits))
    return f"{fits} fits; {held:.1f} % of {len(hits)} intervals contain the truth (95 +- {give:.1f} if honest)"


def headline(kept: int, drafts: int, held: float) -> str:
    """The result in a sentence, of drafts and of the percent of intervals that hold the truth."""
    return (
        f"{kept} of {drafts} drafts use nine tenths of the motion or more; {held:.1f} % of the intervals of trusted "
        "fits contain the truth."
    )


def _page(done: Sequence[Kept]) -> str:
    body = ["", "| logs | kept |", "|---|---|", f"| all | {_told(done)} |"]
    body += [f"| {name} | {_told(each)} |" for name, each in _groups(done).items()]
    body += [
        f"| intervals of trusted fits | {intervals([k for k in done if k.trusted])} |",
        f"| intervals of the other fits | {intervals([k for k in done if not k.trusted])} |",
        "",
        "Logs that lose more than a tenth, and intervals that miss the truth:",
        "",
        "| log | conditions | moves [s] | kept [%] | windows and motion | intervals that miss |",
        "|---|---|---|---|---|---|",
    ]
    for k in done:
        c = k.case
        missed = ", ".join(n for n, hit in k.held.items() if not hit)
        if k.share >= KEPT and not missed:
            continue
        how = ["driven" if c.driven else "let go", "rests before" * c.before, "rests after" * c.after]
        how += ["named" if c.named else "not named", f"noise {c.noise:g}"]
        how += ["thrice"] if c.again else []
        missed += "" if k.trusted or not missed else " (not trusted)"
        told = (c.name, ", ".join(filter(None, how)), f"{k.moved:.1f}", f"{100 * k.share:.0f}", k.said, missed)
        body.append("| " + " | ".join(x.replace("|", "/") for x in told) + " |")
    trusted = [hit for k in done if k.trusted for hit in k.held.values()]
    held = 100 * float(np.mean(trusted or [math.nan]))
    result = headline(sum(k.share >= KEPT for k in done), len(done), held)
    return page("kept", "What moves is kept", __doc__, body, result)
