"""What would people use instead, and how does it do on the same logs?

Everyone gets the same samples, the same model, the same known numbers and the same guesses, and is used as its authors
advise; the scripts stand beside this one, in `benchmarks/peers`. A run that was held out is predicted with the physics
frozen and its start refitted, freely from its first sample; a tail from the start of what was fitted, refitted to what
comes before the samples that count. Extra `peers`: `pip install '.[peers]'`. opty is missing: it
needs ipopt, whose Python interface (cyipopt) has no wheel on the index that we install from. No public log of a
cart-pendulum or a Furuta pendulum is among the tasks yet.
"""

from __future__ import annotations

import contextlib
import importlib
import inspect
import io
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import ModuleType

import numpy as np

from benchmarks.measure import Line, page

TWINS, FEW = 20, 8
"""Twins of each kind, and for a peer that takes half a minute for one."""
TIE = 0.2
"""Points of fit percent by which two predictions may differ and be as good."""
STRIBECK = 0.4
POOR = 0.3
"""Seconds of a twin's motion that tell little."""


@dataclass(frozen=True, kw_only=True)
class Peer:
    """One way to identify: its name, module and function, the distribution it needs, twins it is put to."""

    name: str
    module: str
    needs: str = ""
    part: str = "answer"
    twins: int = TWINS

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
    Peer(name="mujoco.sysid", module="with_mujoco", needs="mujoco", twins=FEW),
)
BLACK = (
    Peer(name="SINDy (pysindy)", module="black_boxes", part="sindy", needs="pysindy"),
    Peer(name="NARX (sysidentpy)", module="black_boxes", part="narx", needs="sysidentpy"),
    Peer(name="ARX", module="black_boxes", part="arx"),
)


def run(*, quick: bool, progress: Callable[[str], None], markdown: Path | None = None) -> list[Line]:
    """A line of each peer and each question; `quick`, one twin, and nobody who takes half a minute."""
    try:
        from benchmarks.peers.task import TAILS, tail, twin
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
        body += ["", "## Runs that were held out: fit percent", "", *_tails(grey + black, tasks, lines, progress)]
        body += ["", "## Do halves of one record agree?", "", *_halves(grey, tasks, lines, progress)]
    else:
        lines.append(Line(contender="real logs", note="left out: UPRIGHT_REAL_DATA names no folder"))
    count = 1 if quick else TWINS
    for title, stribeck in (("with a right model", 0.0), ("with Stribeck friction that nobody models", STRIBECK)):
        tasks = [twin(seed, stribeck=stribeck) for seed in range(count)]
        body += ["", f"## Intervals of 95 % on Furuta twins {title}", "", *_twins(grey, title, tasks, lines, progress)]
    whole = twin(0)
    poor = replace(whole, fitted=whole.fitted.part(0, round(POOR / 2e-3)))
    body += ["", f"## What is said of poor data ({POOR:g} s of a twin)", "", *_poor(grey, poor, lines, progress)]
    body += ["", "## Lines that a user writes", "", *_lines(grey)]
    if markdown is not None:
        note = ", ".join(f"{name} {version(name)}" for name in _versions())
        markdown.write_text(page("peers", "Peers", __doc__, ["", f"Versions: {note}.", *body]), encoding="utf-8")
    return lines


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
    for name in ("upright", "scipy", "numba", "lmfit", "mujoco", "pysindy", "sysidentpy"):
        with contextlib.suppress(PackageNotFoundError):
            version(name)
            out.append(name)
    return out


def _tails(peers, tasks, lines, progress) -> list[str]:
    from benchmarks.peers.task import fit_percent

    labels = [(task, label) for task in tasks for label in task.held_out]
    body = [f"| | {' | '.join(f'{task.name}, {label}' for task, label in labels)} | seconds |",
            f"|---|{'--:|' * (len(labels) + 1)}"]  # fmt: skip
    ours: list[float] = []
    ahead: list[str] = []
    for peer in peers:
        cells: list[str] = []
        seconds: list[float] = []
        percents: list[float] = []
        for task in tasks:
            progress(f"{peer.name}: {task.name}")
            said = peer.solve(task)
            seconds.append(said.seconds)
            for label, held in task.held_out.items():
                percent = fit_percent(held, said.predicted[label])
                cells.append(" / ".join(f"{p:.1f}" if p > -100 else "< -100" for p in percent))
                percents.append(float(np.mean(percent)))
        body.append(f"| {peer.name} | {' | '.join(cells)} | {', '.join(f'{s:.2g}' for s in seconds)} |")
        lines.append(Line(contender=f"held out: {peer.name}", note=", ".join(cells)))
        ours = ours or percents
        better = [k for k, (own, other) in enumerate(zip(ours, percents, strict=True)) if other > own + TIE]
        ahead += [f"{peer.name} on {labels[k][0].name}, {labels[k][1]}" for k in better]
    first = f"Better than upright by more than {TIE:g} points: {'; '.join(ahead) or 'nobody'}."
    return [first, "", *body]


def _halves(peers, tasks, lines, progress) -> list[str]:
    body = ["Each half of the fitted stretch is identified by itself; numbers whose two intervals overlap.", "",
            f"| | {' | '.join(task.name for task in tasks)} |", f"|---|{'--:|' * len(tasks)}"]  # fmt: skip
    for peer in peers:
        cells: list[str] = []
        for task in tasks:
            progress(f"{peer.name}: halves of {task.name}")
            half = task.fitted.t.size // 2
            parts = [task.fitted.part(0, half), task.fitted.part(half, 2 * half)]
            first, second = (peer.solve(replace(task, fitted=part, held_out={})).intervals for part in parts)
            both = [n for n in task.guesses if n in first and n in second]
            agree = sum(max(first[n][0], second[n][0]) <= min(first[n][1], second[n][1]) for n in both)
            none = len(task.guesses) - len(both)
            cells.append(f"{agree} of {len(task.guesses)}" + (f" ({none} without interval)" if none else ""))
        body.append(f"| {peer.name} | {' | '.join(cells)} |")
        lines.append(Line(contender=f"halves agree: {peer.name}", note=", ".join(cells)))
    return body


def _twins(peers, title, tasks, lines, progress) -> list[str]:
    body = [
        "Share of the intervals that hold the truth, their width and the estimates' error in percent of it (medians).",
        "", "| | twins | hold the truth | width | error | seconds for one |", "|---|--:|--:|--:|--:|--:|",
    ]  # fmt: skip
    for peer in peers:
        held: list[bool] = []
        widths: list[float] = []
        errors: list[float] = []
        seconds: list[float] = []
        failed = 0
        mine = tasks[: peer.twins]
        for task in mine:
            progress(f"{peer.name}: {title}, {task.name}")
            try:
                said = peer.solve(task)
            except Exception as error:
                progress(f"{peer.name} failed: {error}")
                failed += 1
                held += [False] * len(task.truth)
                continue
            seconds.append(said.seconds)
            for n, true in task.truth.items():
                low, high = said.intervals.get(n, (np.inf, -np.inf))
                held.append(low <= true <= high)
                widths += [100 * (high - low) / true] if low <= high else []
                errors.append(100 * abs(said.values[n] / true - 1))
        share = 100 * float(np.mean(held))
        row = f"{share:.0f} % | {np.median(widths):.2g} | {np.median(errors):.2g} | {np.median(seconds):.2g}"
        body.append(f"| {peer.name} | {len(mine)}{f', {failed} failed' if failed else ''} | {row} |")
        lines.append(Line(contender=f"{title}: {peer.name}", note=f"{share:.0f} % of {len(held)} intervals"))
    return body


def _poor(peers, task, lines, progress) -> list[str]:
    body = ["| | intervals that hold the truth | widest [% of the truth] | it says |", "|---|--:|--:|---|"]
    for peer in peers:
        progress(f"{peer.name}: poor data")
        try:
            said = peer.solve(task)
        except Exception as error:
            body.append(f"| {peer.name} | | | it fails: {str(error).splitlines()[0][:120]} |")
            continue
        inside = [low <= task.truth[n] <= high for n, (low, high) in said.intervals.items()]
        widest = max((100 * (high - low) / task.truth[n] for n, (low, high) in said.intervals.items()), default=np.nan)
        words = " ".join(said.says.split()).replace("|", "/")
        body.append(f"| {peer.name} | {sum(inside)} of {len(task.truth)} | {widest:.2g} | {words[:420] or 'nothing'} |")
        lines.append(Line(contender=f"poor data: {peer.name}", note=f"{sum(inside)} of {len(task.truth)} hold"))
    return body


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
    }
    body = ["For one Furuta twin, without blank lines, comments and docstrings; upright's are those of its study.", "",
            "| | lines |", "|---|--:|"]  # fmt: skip
    for peer in peers:
        if peer.name == "upright":
            count = len([line for line in study_text(twin(0)).splitlines() if line.strip()])
        else:
            count = sum(_written(inspect.getsource(s)) for s in sources[peer.name])  # type: ignore[arg-type]
            count += _written(inspect.getsource(peer.code)) if peer.name in ("lmfit", "mujoco.sysid") else 0
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
