"""What would people use instead, and how does it do on the same logs?

Everybody gets the same samples, the same model, the same known parameters and the same guesses, and is used as its
authors advise. The scripts are in `benchmarks/peers`.

- **Held-out runs** are predicted with fixed physics and a refitted start: freely from the first sample, or, for a tail,
  from the start of what was fitted, refitted to the samples before those that count.
- **The driven Furuta pendulum** (macstepien): a sine of 4 V is fitted and one of 2 V predicted, its first angles
  refitted; results are arm / pendulum. The lean of its base and the lag of its drive are in nobody's model.
- **SINDy and NARX**, as written here, take one angle and no command.
- **Seconds** are CPU seconds, compilers included, so that other work on the machine does not count as much.

Who is ahead of upright stands above each table, and what that comes of below it.

Extra `peers`: `pip install '.[peers]'`. opty also needs IPOPT, whose Python interface (cyipopt) is built from source:
`apt install coinor-libipopt-dev liblapack-dev libblas-dev pkg-config gcc`, then `pip install cyipopt opty`. A tool that
is not installed is left out of the tables.
"""

from __future__ import annotations

import contextlib
import importlib
import inspect
import io
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from itertools import product, takewhile
from multiprocessing import get_context
from pathlib import Path
from types import ModuleType
from typing import TypeVar

import numpy as np

from benchmarks.measure import Line, page, shares

T = TypeVar("T")
TWINS, FEW = 20, 8
"""Twins of each kind, and for a peer that takes half a minute for one."""
TIE = 0.2
"""Points of fit percent by which two predictions may differ and be as good."""
STRIBECK = 0.4
HELD_OUT, HALVES = "Runs that were held out: fit percent", "Do halves of one record agree?"
APART = {
    "qube": "A balanced QUBE-Servo, predicted ahead: fit percent",
    "carts": "Two carts on springs, every run held out in turn: fit percent",
}
"""Sections whose tasks have modules of their own."""
SECTIONS = {"tails": HELD_OUT, **APART}
"""Sections that `python -m benchmarks.peers NAME` renews."""
TRUTHS = ("with a right model", "with Stribeck friction that nobody models")
INTERVALS = "Intervals of 95 % on Furuta twins {}"
VERSIONS = "Versions: "
PREDICTED = ("held out", *APART)
"""Questions whose lines are fit percents of what nobody saw."""
POOR = 0.3
"""Seconds of a twin's motion that tell little."""


@dataclass(frozen=True, kw_only=True)
class Peer:
    """One way to identify: its name, module and function, what it needs, twins it is put to, plants that it takes."""

    name: str
    module: str
    needs: str = ""
    part: str = "answer"
    twins: int = TWINS
    plants: tuple[str, ...] = ("pendulum", "furuta")

    @property
    def code(self) -> ModuleType:
        """Where it is written."""
        return importlib.import_module(f"benchmarks.peers.{self.module}")

    def solve(self, task):
        """Its answer, its chatter left out."""
        with contextlib.redirect_stdout(io.StringIO()):
            return getattr(self.code, self.part)(task)


GREY = (
    Peer(name="upright", module="ours"),
    Peer(name="scipy least_squares", module="least_squares", needs="numba"),
    Peer(name="the same, block sandwich", module="least_squares", needs="numba", part="robust"),
    Peer(name="lmfit", module="with_lmfit", needs="numba"),
    Peer(name="opty", module="with_opty", needs="opty", twins=FEW),
    Peer(name="mujoco.sysid", module="with_mujoco", needs="mujoco", twins=FEW),
)
BLACK = (
    Peer(name="SINDy (pysindy)", module="black_boxes", part="sindy", needs="pysindy", plants=("pendulum",)),
    Peer(name="NARX (sysidentpy)", module="black_boxes", part="narx", needs="sysidentpy", plants=("pendulum",)),
    Peer(name="ARX", module="black_boxes", part="arx"),
)


def run(*, quick: bool, progress: Callable[[str], None], markdown: Path | None = None) -> list[Line]:
    """A line of each peer and each question; `quick`, one twin, and nobody who takes half a minute."""
    try:
        from benchmarks.peers.task import TAILS, driven, tail, twin
    except ImportError as error:
        return [Line(contender="peers", note=f"left out: {error}; pip install '.[peers]'")]
    grey, missing = _present(GREY)
    black, more = _present(BLACK)
    lines = [Line(contender=name, note=f"left out: {why}") for name, why in {**missing, **more}.items()]
    if "scipy least_squares" in missing:
        return lines  # the twins are made by its equations
    if quick:
        grey = [p for p in grey if p.twins == TWINS]
    body: list[str] = []
    if data := os.environ.get("UPRIGHT_REAL_DATA"):
        tasks = [tail(study, Path(data)) for study in (TAILS[-1:] if quick else TAILS)]
        shaken = [] if quick else [driven(Path(data))]
        body += ["", f"## {HELD_OUT}", "", *_tails(grey + black, tasks + shaken, lines, progress)]
        for name in () if quick else APART:
            body += ["", f"## {APART[name]}", "", *section(name, Path(data), lines, progress)]
        body += ["", f"## {HALVES}", "", *_halves(grey, tasks, lines, progress)]
    else:
        lines.append(Line(contender="real logs", note="left out: UPRIGHT_REAL_DATA names no folder"))
    count = 1 if quick else TWINS
    for title, stribeck in zip(TRUTHS, (0.0, STRIBECK), strict=True):
        tasks = [twin(seed, stribeck=stribeck) for seed in range(count)]
        body += ["", f"## {INTERVALS.format(title)}", "", *_twins(grey, title, tasks, lines, progress)]
    whole = twin(0)
    poor = replace(whole, fitted=whole.fitted.part(0, round(POOR / 2e-3)))
    body += ["", f"## What is said of poor data ({POOR:g} s of a twin)", "", *_poor(grey, poor, lines, progress)]
    body += ["", "## Lines that a user writes", "", *_lines(grey)]
    if markdown is not None:
        note = ", ".join(f"{name} {version(name)}" for name in _versions())
        markdown.write_text(_page([f"{VERSIONS}{note}.", *body], headline(lines)), encoding="utf-8")
    return lines


def _page(body: Sequence[str], headline: str) -> str:
    return page("peers", "Peers", __doc__, ["", *body], headline)


def headline(lines: Sequence[Line]) -> str:
    """The result in a sentence, from the lines of what was predicted and of the twins' intervals."""
    cells: dict[str, dict[str, list[float | None]]] = {}
    for line in lines:
        question, _, peer = line.contender.partition(": ")
        if question in PREDICTED:
            cells.setdefault(question, {})[peer] = [_mean(cell) for cell in line.note.split(", ")]
    best, runs = 0, 0
    for peers in cells.values():
        for own, *others in zip(peers.pop("upright"), *peers.values(), strict=True):
            best += own is not None and own >= max(x for x in others if x is not None) - TIE
            runs += 1
    held = {name: share for name, share in shares(lines).items() if name.startswith("with ")}
    own, others = ([x for name, x in held.items() if name.endswith(": upright") is mine] for mine in (True, False))
    return (
        f"Of {runs} predictions of unseen samples upright's is the best, or within {TIE:g} points of it, in {best}; "
        f"its 95 % intervals hold the truth of twins in {' and '.join(f'{x:.0f}' for x in own)} % of the cases, those "
        f"of the others in {min(others):.0f} to {max(others):.0f} %."
    )


def _mean(cell: str) -> float | None:
    """Of the fit percents in a cell; None where there are none, or one diverged."""
    try:
        return float(np.mean([float(part) for part in cell.split(" / ")]))
    except ValueError:
        return None


def _present(peers: tuple[Peer, ...]) -> tuple[list[Peer], dict[str, str]]:
    found: list[Peer] = []
    missing: dict[str, str] = {}
    for peer in peers:
        try:
            importlib.import_module(peer.needs or "numpy")
            peer.code  # noqa: B018
        except ImportError as error:
            missing[peer.name] = str(error)
        else:
            found.append(peer)
    return found, missing


def _versions() -> list[str]:
    out: list[str] = []
    for name in ("upright", "scipy", "numba", "lmfit", "mujoco", "opty", "pysindy", "sysidentpy"):
        with contextlib.suppress(PackageNotFoundError):
            version(name)
            out.append(name)
    return out


def _solved(pair):
    """A peer's answer to a task, or the error that it ends with."""
    peer, task = pair
    try:
        return peer.solve(task)
    except Exception as error:
        return error


def _answers(pairs: Iterable[tuple[Peer, object]], progress) -> list:
    """Answers in order, a process on each processor; a peer's own threads stay out of the others' way."""
    pairs = list(pairs)
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn")) as pool:
        answers = []
        for (peer, task), answer in zip(pairs, pool.map(_solved, pairs), strict=True):
            progress(f"{peer.name}: {task.name}{f', failed: {answer}' if isinstance(answer, Exception) else ''}")
            answers.append(answer)
    return answers


def _tails(peers, tasks, lines, progress) -> list[str]:
    from benchmarks.peers.leads import Lead, explained
    from benchmarks.peers.task import fit_percent

    labels = [(task, label) for task in tasks for label in task.held_out]
    body = [f"| | {' | '.join(f'{task.name}, {label}' for task, label in labels)} | seconds |",
            f"|---|{'--:|' * (len(labels) + 1)}"]  # fmt: skip
    pairs = [(peer, task) for peer, task in product(peers, tasks) if task.plant in peer.plants]
    solved = {(p.name, t.name): a for (p, t), a in zip(pairs, _answers(pairs, progress), strict=True)}
    means: dict[str, list[float | None]] = {}
    for peer in peers:
        cells: list[str] = []
        seconds: list[str] = []
        means[peer.name] = []
        for task in tasks:
            answer = solved.get((peer.name, task.name))
            failed = answer is None or isinstance(answer, Exception)
            seconds.append("–" if failed else f"{answer.seconds:.2g}")
            for label, held in task.held_out.items():
                percent = [] if failed else fit_percent(held, answer.predicted[label])
                cells.append(" / ".join(f"{p:.1f}" if p > -100 else "< -100" for p in percent) or "–")
                means[peer.name].append(float(np.mean(percent)) if percent else None)
        body.append(f"| {peer.name} | {' | '.join(cells)} | {', '.join(seconds)} |")
        lines.append(Line(contender=f"held out: {peer.name}", note=", ".join(cells)))
    ahead = _ahead(means, labels)
    leads = [
        Lead(peer=name, run=run, task=task, theirs=solved[name, task.name], ours=solved["upright", task.name])
        for name, (task, run), _ in ahead
        if solved[name, task.name].values
    ]
    progress(f"why {len(leads)} leads")
    collocated = next(peer for peer in GREY if peer.name == "opty").solve
    better = _better([(name, f"{task.name}, {label}", points) for name, (task, label), points in ahead])
    return [better, "", *body, *explained(leads, collocated, TIE)]


def section(name: str, data: Path, lines: list[Line], progress: Callable[[str], None]) -> list[str]:
    """One of `SECTIONS`, all peers that are installed."""
    from benchmarks.peers.task import TAILS, driven, tail

    if name in APART:
        return _apart(name, data, lines, progress)
    peers = [peer for all_ in (GREY, BLACK) for peer in _present(all_)[0]]
    return _tails(peers, [*(tail(study, data) for study in TAILS), driven(data)], lines, progress)


def _apart(name: str, data: Path, lines: list[Line], progress: Callable[[str], None]) -> list[str]:
    """A section whose task has a module of its own: what it asks, who is better than upright, the table, and why."""
    code = importlib.import_module(f"benchmarks.peers.{name}")
    written = code.table(data, progress)
    rows = list(takewhile(bool, written))
    found = _predictions(name, rows)
    lines += found
    labels = [cell.strip() for cell in rows[0].split("|")[2:-2]]
    means = {line.contender.partition(": ")[2]: [_mean(cell) for cell in line.note.split(", ")] for line in found}
    return [*(code.__doc__ or "").strip().splitlines(), "", _better(_ahead(means, labels)), "", *written]


def _predictions(question: str, rows: Sequence[str]) -> list[Line]:
    """Lines of a table of fit percents, whose first cell is a peer and whose last one is seconds."""
    cells = [[cell.strip() for cell in row.strip()[1:-1].split("|")] for row in rows[2:]]
    return [Line(contender=f"{question}: {own[0]}", note=", ".join(own[1:-1])) for own in cells]


def _ahead(means: Mapping[str, Sequence[float | None]], labels: Sequence[T]) -> list[tuple[str, T, float]]:
    """Who predicts better than upright, which run, and by how many points."""
    return [
        (name, label, other - own)
        for name, others in means.items()
        for label, own, other in zip(labels, means["upright"], others, strict=True)
        if own is not None and other is not None and other > own + TIE
    ]


def _better(ahead: Sequence[tuple[str, str, float]]) -> str:
    """The same as a sentence."""
    who = "; ".join(f"{name} on {label} ({points:.1f})" for name, label, points in ahead) or "nobody"
    return f"Better than upright by more than {TIE:g} points, in the mean of a run's signals: {who}."


def lines_in(text: str) -> list[Line]:
    """Lines of a published page that its headline rests on, read back from its tables."""
    sections = dict(part.split("\n", 1) for part in text.split("\n## ")[1:])
    tables = {title: [row for row in part.splitlines() if row.startswith("|")] for title, part in sections.items()}
    lines = _predictions("held out", tables[HELD_OUT])
    for name in APART:
        lines += _predictions(name, tables.get(APART[name], []))
    for kind in TRUTHS:
        cells = [[cell.strip() for cell in row[1:-1].split("|")] for row in tables[INTERVALS.format(kind)][2:]]
        lines += [Line(contender=f"{kind}: {own[0]}", note=own[2]) for own in cells]
    return lines


def renewed(text: str, name: str, section: Sequence[str]) -> str:
    """A published page with one of `SECTIONS`, a new one put before the halves, and the headline that then holds."""
    first, *parts = text.split("\n## ")
    titles = [part.partition("\n")[0] for part in parts]
    title = SECTIONS[name]
    place = titles.index(title) if title in titles else titles.index(HALVES)
    parts[place : place + (title in titles)] = ["\n".join([title, "", *section, ""])]
    text = "\n## ".join([first.rstrip("\n") + "\n", *parts])
    return _page((VERSIONS + text.partition(VERSIONS)[2]).splitlines(), headline(lines_in(text)))


def _halves(peers, tasks, lines, progress) -> list[str]:
    body = ["Each half of the fitted stretch is identified by itself; numbers whose two intervals overlap.", "",
            f"| | {' | '.join(task.name for task in tasks)} |", f"|---|{'--:|' * len(tasks)}"]  # fmt: skip
    halves = []
    for task in tasks:
        half = task.fitted.t.size // 2
        parts = (task.fitted.part(0, half), task.fitted.part(half, 2 * half))
        halves += [replace(task, fitted=part, held_out={}) for part in parts]
    answers = iter(_answers(product(peers, halves), progress))
    for peer in peers:
        cells: list[str] = []
        for task in tasks:
            first, second = (getattr(next(answers), "intervals", {}) for _ in range(2))
            both = [n for n in task.guesses if n in first and n in second]
            agree = sum(max(first[n][0], second[n][0]) <= min(first[n][1], second[n][1]) for n in both)
            none = len(task.guesses) - len(both)
            cells.append(
                f"{agree} of {len(both)}{f', {none} without interval' if none else ''}" if both else "no intervals"
            )
        body.append(f"| {peer.name} | {' | '.join(cells)} |")
        lines.append(Line(contender=f"halves agree: {peer.name}", note=", ".join(cells)))
    return body


def _twins(peers, title, tasks, lines, progress) -> list[str]:
    body = [
        "Share of the intervals that hold the truth, their width and the estimates' error in percent of it (medians).",
        "", "| | twins | hold the truth | width | error | seconds for one |", "|---|--:|--:|--:|--:|--:|",
    ]  # fmt: skip
    pairs = [(peer, task) for peer in peers for task in tasks[: peer.twins]]
    answers = iter(_answers(pairs, progress))
    for peer in peers:
        mine = tasks[: peer.twins]
        held: list[bool] = []
        widths: list[float] = []
        errors: list[float] = []
        seconds: list[float] = []
        failed = 0
        for task in mine:
            said = next(answers)
            if isinstance(said, Exception):
                failed += 1
                held += [False] * len(task.truth)
                continue
            seconds.append(said.seconds)
            for n, true in task.truth.items():
                low, high = said.intervals.get(n, (np.inf, -np.inf))
                held.append(low <= true <= high)
                widths += [100 * (high - low) / true] if low <= high else []
                errors.append(100 * abs(said.values[n] / true - 1))
        share = f"{100 * np.mean(held):.0f} %" if widths else "no intervals"
        row = f"{share} | {f'{np.median(widths):.2g}' if widths else '–'}"
        row += f" | {np.median(errors):.2g} | {np.median(seconds):.2g}" if seconds else " | – | –"
        body.append(f"| {peer.name} | {len(mine)}{f', {failed} failed' if failed else ''} | {row} |")
        lines.append(Line(contender=f"{title}: {peer.name}", note=f"{share} of {len(held)}"))
    return body


def _poor(peers, task, lines, progress) -> list[str]:
    body = ["| | intervals that hold the truth | widest [% of the truth] | it says |", "|---|--:|--:|---|"]
    for peer, said in zip(peers, _answers([(peer, task) for peer in peers], progress), strict=True):
        if isinstance(said, Exception):
            body.append(f"| {peer.name} | – | – | it fails: {str(said).splitlines()[0][:120]} |")
            continue
        inside = [low <= task.truth[n] <= high for n, (low, high) in said.intervals.items()]
        widths = [100 * (high - low) / task.truth[n] for n, (low, high) in said.intervals.items()]
        share = f"{sum(inside)} of {len(task.truth)}" if widths else "no intervals"
        widest = f"{max(widths):,.0f}" if widths else "–"
        words = _whole(" ".join(said.says.split()).replace("|", "/"))
        body.append(f"| {peer.name} | {share} | {widest} | {words or 'nothing'} |")
        lines.append(Line(contender=f"poor data: {peer.name}", note=share))
    return body


def _whole(words: str, most: int = 420) -> str:
    """As many whole sentences as fit."""
    kept = ""
    for sentence in words.split(". "):
        more = f"{kept}. {sentence}" if kept else sentence
        if kept and len(more) > most:
            return f"{kept}. …"
        kept = more
    return kept


def _lines(peers) -> list[str]:
    from benchmarks.peers import by_hand, least_squares
    from benchmarks.peers.task import study_text, twin

    equations = [by_hand._furuta, by_hand.furuta]
    shared = [getattr(f, "py_func", f) for f in equations]
    start = [least_squares.started, least_squares.simulated, least_squares.residual]
    sources: Mapping[str, list[object]] = {
        "scipy least_squares": [*shared, *start, least_squares.fitted],
        "the same, block sandwich": [*shared, *start, least_squares.fitted],
        "lmfit": [*shared, *start],
        "mujoco.sysid": [],
        "opty": [least_squares.started, least_squares.predict],
    }
    body = ["For one Furuta twin, without blank lines, comments and docstrings; upright's are those of its study.", "",
            "| | lines |", "|---|--:|"]  # fmt: skip
    for peer in peers:
        if peer.name == "upright":
            count = len([line for line in study_text(twin(0)).splitlines() if line.strip()])
        else:
            count = sum(_written(inspect.getsource(s)) for s in sources[peer.name])  # type: ignore[arg-type]
            count += _written(inspect.getsource(peer.code)) if peer.name in ("lmfit", "mujoco.sysid", "opty") else 0
        body.append(f"| {peer.name} | {count} |")
    return body


def _written(source: str) -> int:
    """Lines of code."""
    import ast

    tree = ast.parse(inspect.cleandoc(source) if source[:1] == " " else source)
    docs = {
        line
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }
    return sum(
        bool(line.strip()) and not line.strip().startswith("#") and k not in docs
        for k, line in enumerate(source.splitlines(), 1)
    )
