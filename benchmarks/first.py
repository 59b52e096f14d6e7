"""What becomes of a log that nobody edits, through `show`, `init`, `identify` and `design`?

The logs are every public log (UPRIGHT_REAL_DATA) and 100 logs of twins, 20 of each plant. Each is written in three
dialects:

- units in brackets, commas
- milliseconds and degrees or millimetres, semicolons and decimal commas
- units behind underscores, tabs

The twins have dry friction, encoder counts and noise of 0 to 0.005 rad. They rest for a second, are driven by steps or
released, and rest again. A parameter is usable when the fit is trusted and calls it well determined. It is wrong when
its interval misses the truth and it is a fifth off.

Required:

- no placeholder that `init` writes is among usable parameters or what they rest on
- no more than a tenth of the motion is left out without a word
- each log takes 10 s of CPU at most
- the three dialects of one log give the same answer
"""

from __future__ import annotations

import math
import os
import re
import signal
import tempfile
import threading
import time
import tomllib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure import Line, Target, of_each, page, spread
from benchmarks.rigs import MAKES, Make, command, drawn
from upright.workers import HERE, Workers

DT, REST, MOVED = 5e-3, 1.0, 8.0
GAIN = {"furuta": 0.05, "cart-pendulum": 1.7, "torsional-2": 0.1, "rectilinear-2": 6.0}
"""Force per volt."""
SECONDS, KEPT, OFF = 10.0, 0.9, 0.2
PATIENCE = 60.0
"""CPU seconds after which a step is given up: enough for a slow machine to come to the answer that it is late with."""
ADDITIONS, USUAL = 10**6, 0.05
"""In Python, and the CPU seconds that they take where the 10 s are meant."""
ENDS = ("trusted", "not trusted", "refused", "out of time", "error")
DIALECTS = ("brackets", "milliseconds", "tabs")
NOT_MEASURED = re.compile(
    r"^(u|n|sample)$|target|reference|command|duty|effort|input|output|feedforward|saturation|velocity|offset", re.I
)
"""Names of columns that say what was asked for, and no place of a body."""
NO_LOGS = ("README", "EstimatedParameters", "parameters.yaml", "controller.toml", "README_system_id")


@dataclass(frozen=True, kw_only=True)
class Source:
    """A log before it is written in a dialect: columns [SI] with their units, and the truth where it is known."""

    name: str
    t: np.ndarray
    columns: dict[str, tuple[str, np.ndarray]]
    truth: dict[str, float] = field(default_factory=dict[str, float])
    plant: str = ""


@dataclass(frozen=True, kw_only=True)
class Contact:
    """What one log in one dialect came to."""

    log: str
    dialect: str
    ended: str
    """Of `ENDS`; an error is a bare exception."""
    said: str
    refusal: str = ""
    """What `design` said where it is the step that did not come through."""
    taken: dict[str, float] = field(default_factory=dict[str, float])
    """CPU seconds by step."""
    usable: dict[str, float] = field(default_factory=dict[str, float])
    values: dict[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    """Estimate and half its interval by name."""
    wrong: tuple[str, ...] = ()
    placeholders: tuple[str, ...] = ()
    plant: str = ""
    kept: float | None = None
    seconds: float = 0.0
    held: bool | None = None
    """Whether the loop that was designed holds the true rig; None where none was designed or no truth is known."""


def twins(count: int) -> list[Source]:
    """Logs of as many twins of each plant."""
    return [_twin(make, 9000 + 100 * place + k) for place, make in enumerate(MAKES) for k in range(count)]


def _twin(make: Make, seed: int) -> Source:
    from upright.physics import find
    from upright.simulation import simulate

    generator = np.random.default_rng(seed)
    plant = find(make.plant)
    truth, _ = drawn(make, generator)
    rest, moved = round(REST / DT), round(MOVED / DT)
    before = rest if make.force else 0
    samples = before + moved + rest
    u = np.zeros((samples, 1))
    start = dict(make.start) if not make.force else {}
    if make.force:
        u[before : before + moved] = command(make.force, moved, generator)
    gain = GAIN.get(make.plant, 1.0)
    volts = u / gain
    drive = {"actuator.gain": gain} if plant.inputs else {}
    x0 = [start.get(n, 0.0) for n in plant.state_names()]
    x = simulate(
        plant(**truth, **make.known), drive, x0, volts if plant.inputs else None, DT, samples=samples, substeps=2
    )  # fmt: skip
    noise = generator.uniform(0, 0.005) if generator.random() < 0.5 else 0.0
    names = [c.name for c in plant.coordinates]
    units = [c.unit for c in plant.coordinates]
    columns: dict[str, tuple[str, np.ndarray]] = {}
    for i, (name, unit, resolution) in enumerate(zip(names, units, make.resolution, strict=True)):
        y = x[:, 2 * i, 0] + (noise if unit == "rad" else 0.01 * noise) * generator.normal(size=samples)
        columns[name] = (unit, np.round(y / resolution) * resolution)
    if plant.inputs:
        columns["u"] = ("V", volts[:, 0])
    return Source(
        name=f"{make.plant} {seed}", t=np.arange(samples) * DT, columns=columns, plant=make.plant,
        truth=truth | make.known | ({"actuator.gain": gain} if plant.inputs else {}),
    )  # fmt: skip


def public() -> list[Source]:
    """Every public log that a reader reads."""
    from upright.errors import UprightError
    from upright.readers import read

    data = os.environ.get("UPRIGHT_REAL_DATA", "")
    found: list[Source] = []
    for path in sorted(Path(data).rglob("*")) if data else []:
        if not path.is_file() or any(text in path.name for text in NO_LOGS):
            continue
        try:
            record = read(path)
        except UprightError as error:
            print(f"{path.relative_to(data)}: {error}")
            continue
        columns = {n: (record.units.get(n, "") or "", np.asarray(v)) for n, v in record.signals.items()}
        found.append(Source(name=path.relative_to(data).as_posix(), t=np.asarray(record.t), columns=columns))
    return found


def written(source: Source, dialect: str, folder: Path) -> Path:
    """The log in a dialect."""
    path = folder / f"{dialect}.{'tsv' if dialect == 'tabs' else 'csv'}"
    small = {"rad": ("deg", 180 / math.pi), "m": ("mm", 1e3), "V": ("mV", 1e3)}
    time_unit, per = ("ms", 1e3) if dialect == "milliseconds" else ("s", 1.0)
    columns = [("t", time_unit, per * (source.t - source.t[0]))]
    for name, (unit, values) in source.columns.items():
        other, factor = small.get(unit, (unit, 1.0)) if dialect == "milliseconds" else (unit, 1.0)
        columns.append((name, other, factor * values))
    form = "{}_{}" if dialect == "tabs" else "{} [{}]"
    header = [form.format(n, u) if u else n for n, u, _ in columns]
    mark = {"brackets": ",", "milliseconds": ";", "tabs": "\t"}[dialect]
    lines = [mark.join(header)]
    for row in np.column_stack([v for _, _, v in columns]):
        text = [f"{x:.9g}" for x in row]
        lines.append(mark.join(x.replace(".", ",") for x in text) if dialect == "milliseconds" else mark.join(text))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def moving(source: Source) -> tuple[float, float]:
    """First and last instant [s from the first sample] at which a measured column moves, by half a percent of its range
    (two percent where it is noisy) within a quarter of a second."""
    t = source.t - source.t[0]
    n = max(2, int(np.searchsorted(t, 0.25)))
    inside = np.zeros(t.size, bool)
    for name, (_, y) in source.columns.items():
        whole = float(np.ptp(y))
        if NOT_MEASURED.search(name) or not whole or y.size <= 4 * n:
            continue
        windows = np.lib.stride_tricks.sliding_window_view(y, n)
        reach = np.ptp(windows, axis=1)
        quiet = float(np.quantile(reach, 0.02))
        inside[: reach.size] |= reach > max(0.02 * whole, 3 * quiet)
    where = np.flatnonzero(inside)
    return (float(t[where[0]]), float(t[where[-1]])) if where.size else (0.0, float(t[-1]))


class OutOfTime(BaseException):
    """A step has taken all of its CPU time; no `except Exception` and no Ctrl-C of a search may take it for its own."""


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """End what takes more CPU seconds, where there is a clock for it: not on Windows, nor beside the main thread."""
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(*_: Any) -> None:
        raise OutOfTime

    before = signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, seconds, 1.0)  # again, should C have swallowed the first
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def met(source: Source, dialect: str) -> Contact:
    """One log in one dialect, as a stranger would take it through."""
    import upright as up
    from upright.errors import UprightError

    with tempfile.TemporaryDirectory() as folder:
        log = written(source, dialect, Path(folder))
        study = Path(folder) / "study.toml"
        steps: dict[str, Callable[[dict[str, Any]], Any]] = {
            "show": lambda _: up.show(log),
            "init": lambda _: up.init(log, out=study),
            "identify": lambda _: up.identify(study),
            "design": lambda done: _designed(source, done["identify"]),
        }
        done: dict[str, Any] = {}
        taken: dict[str, float] = {}
        ended = said = ""
        for step, work in steps.items():
            began = time.process_time()
            try:
                with limited(PATIENCE):
                    done[step] = work(done)
            except OutOfTime:
                ended, said = "out of time", f"{step}: more than {PATIENCE:g} s"
            except UprightError as error:
                ended, said = "refused", f"{step}: {error}"
            except Exception as error:  # what a stranger must never meet
                ended, said = "error", f"{step}: {type(error).__name__}: {error}"
            taken[step] = time.process_time() - began
            if ended:
                break
        drafted = tomllib.loads(study.read_text(encoding="utf-8")) if "init" in done else None
    contact = Contact(
        log=source.name, dialect=dialect, ended=ended, said=said, seconds=sum(taken.values()), taken=taken,
        plant=drafted["rig"]["plant"] if drafted else "",
    )  # fmt: skip
    if drafted is None or "identify" not in done:
        return contact
    fit = done["identify"]
    held, design = done.get("design", (None, said))
    assumed = {n for n, v in drafted["parameters"].items() if isinstance(v, dict) and v.get("assumed")}
    known = dict(fit.estimates) | {n: e for a in fit.assumptions for n, e in a.ratios.items()}
    usable = {n: e.value for n, e in known.items() if fit.trusted and e.status == "well determined" and not e.rests_on}
    truth = _with_lumped(source.truth) if source.plant == contact.plant else {}
    wrong = tuple(n for n, value in usable.items() if _misses(known[n], value, truth.get(n)))
    first, last = moving(source)
    windows = [r.get("window", (0.0, math.inf)) for r in drafted["runs"]]
    covered = sum(max(0.0, min(b, last) - max(a, first)) for a, b in windows) / max(last - first, 1e-9)
    return replace(
        contact, ended=ended or ("trusted" if fit.trusted else "not trusted"), said=f"{fit.verdict} {design}",
        refusal=said, usable=usable, wrong=wrong, held=held, kept=min(covered, 1.0),
        values={n: (e.value, (e.interval[1] - e.interval[0]) / 2) for n, e in fit.estimates.items()},
        placeholders=tuple(sorted(assumed & set(usable))),
    )  # fmt: skip


def _with_lumped(truth: dict[str, float]) -> dict[str, float]:
    """The true numbers, the length of the simple pendulum of equal period, and what forces are per mass and length."""
    if not {"l_cg", "m_p", "J_p"} <= truth.keys():
        return truth
    moment = truth["m_p"] * truth["l_cg"]
    ratios = {f"{n}/(m_p l_cg)": value / moment for n, value in truth.items() if n.startswith(("b_", "actuator.gain"))}
    return truth | ratios | {"J_A/(m_p l_cg)": truth["l_cg"] + truth["J_p"] / moment}


def _misses(estimate: Any, value: float, truth: float | None) -> bool:
    if truth is None:
        return False
    low, high = estimate.interval
    return not low <= truth <= high and abs(value - truth) > OFF * abs(truth)


def _designed(source: Source, fit: Any) -> tuple[bool | None, str]:
    """Whether the loop that is designed for the fit holds the true rig, and what was said of it."""
    import upright as up
    from upright.physics import name_of

    if "inverted" not in fit.rig.plant.equilibria:
        return None, ""
    fastest = float(fit.rig.plant.linear("inverted").poles().real.max())
    n = 2 * len(fit.rig.plant.coordinates)
    if n != 4:
        return None, ""
    poles = [-fastest * x for x in (1.0, 1.25, 1.5, 1.75)]
    design = up.design(fit, poles=poles)
    if not source.truth or source.plant != name_of(type(fit.rig.plant)):
        return None, str(design.verdict)
    true = fit.rig.plant.replace(**{k: v for k, v in source.truth.items() if k in fit.rig.plant.names()})
    model = true.linear("inverted")
    A, B = np.asarray(model.A), np.asarray(model.B) * source.truth["actuator.gain"]
    K = np.asarray(design.K).reshape(1, -1)
    return bool(np.linalg.eigvals(A - B @ K).real.max() < 0), str(design.verdict)


def run(
    *, quick: bool, progress: Callable[[str], None], markdown: Path | None = None, workers: Workers = HERE
) -> list[Line]:
    """A line of each plant's twins and of the public logs, one of the dialects, and one of the time."""
    sources = twins(1 if quick else 20)
    groups = {make.plant: [s for s in sources if s.plant == make.plant] for make in MAKES}
    real = public()[:: 24 if quick else 1]
    groups |= {"public logs": real} if real else {}
    contacts: dict[str, list[Contact]] = {}
    for name, logs in groups.items():
        progress(f"{len(logs)} logs: {name}")
        asked = [(s, d) for s in logs for d in DIALECTS[: 1 if quick else None]]
        contacts[name], _ = of_each(_met, asked, workers)
        if markdown is not None:  # what is done is kept, should somebody interrupt
            markdown.write_text(_page(contacts), encoding="utf-8")
    return [*(_line(name, met) for name, met in contacts.items()), *_whole(contacts)]


def _met(asked: tuple[Source, str]) -> Contact:
    return met(*asked)


def _line(name: str, contacts: Sequence[Contact]) -> Line:
    taken = spread([c.seconds for c in contacts])
    return Line(contender=name, seconds=taken, rounds=len(contacts), target=Target(most=SECONDS, of="seconds"),
                note=_told(contacts))  # fmt: skip


def _told(contacts: Sequence[Contact]) -> str:
    ends = {e: sum(c.ended == e for c in contacts) for e in ENDS}
    parts = [f"{len(contacts)} contacts: " + ", ".join(f"{n} {e}" for e, n in ends.items() if n)]
    numbers = sum(len(c.usable) for c in contacts)
    parts.append(f"{numbers} usable numbers, {sum(len(c.wrong) for c in contacts)} of them wrong, "
                 f"{sum(len(c.placeholders) for c in contacts)} placeholders among them")  # fmt: skip
    kept = [c.kept for c in contacts if c.kept is not None]
    if kept:
        parts.append(f"{sum(k >= KEPT for k in kept)} of {len(kept)} keep nine tenths of what moves")
    held = [c.held for c in contacts if c.held is not None]
    if held:
        parts.append(f"{sum(held)} of {len(held)} loops hold the true rig")
    parts.append(f"{sum(c.seconds <= SECONDS for c in contacts)} of {len(contacts)} within {SECONDS:g} s")
    return "; ".join(parts)


def agreeing(contacts: Sequence[Contact]) -> tuple[int, int]:
    """Logs whose dialects came to the same plant, the same end and the same numbers (a tenth of the interval), of how
    many that were met in several."""
    logs: dict[str, list[Contact]] = {}
    for c in contacts:
        logs.setdefault(c.log, []).append(c)
    several = [each for each in logs.values() if len(each) > 1]
    return sum(_same(each) for each in several), len(several)


def _same(each: Sequence[Contact]) -> bool:
    first = each[0]
    return all(
        (c.ended, c.plant, set(c.values)) == (first.ended, first.plant, set(first.values))
        and all(abs(c.values[n][0] - v) <= 0.2 * half + 1e-3 * abs(v) for n, (v, half) in first.values.items())
        for c in each[1:]
    )


def _whole(contacts: dict[str, list[Contact]]) -> list[Line]:
    every = [c for each in contacts.values() for c in each]
    same, logs = agreeing(every)
    return [
        Line(contender="all", seconds=spread([c.seconds for c in every]), note=_told(every)),
        Line(contender="dialects", note=f"{same} of {logs} logs come to the same answer in every dialect"),
    ]


def _machine() -> str:
    began, total = time.process_time(), 0
    for k in range(ADDITIONS):
        total += k
    return (
        f"Seconds are of this machine's processor, which takes {(time.process_time() - began) / USUAL:.1f} times as "
        "long for a million additions in Python as the one that the 10 s are meant for."
    )


def _page(contacts: dict[str, list[Contact]]) -> str:
    body = ["", _machine(), "", "| logs | what came of them |", "|---|---|"]
    body += [f"| {name} | {_told(each)} |" for name, each in contacts.items()]
    body += [f"| {line.contender} | {line.note} |" for line in _whole(contacts)]
    body += [
        "",
        "| log | dialect | plant | end | kept [%] | time [s] | usable numbers |",
        "|---|---|---|---|---|---|---|",
    ]
    for each in contacts.values():
        for c in each:
            kept = "" if c.kept is None else f"{100 * c.kept:.0f}"
            numbers = ", ".join(f"**{n}**" if n in c.wrong else n for n in c.usable)
            if c.ended in ("refused", "out of time", "error"):
                numbers = (c.refusal or c.said).splitlines()[0].replace("|", "/")[:160]
            body.append(f"| {c.log} | {c.dialect} | {c.plant} | {c.ended} | {kept} | {c.seconds:.1f} | {numbers} |")
    every = [c for each in contacts.values() for c in each]
    trusted, usable, wrong = (
        sum(c.ended == "trusted" for c in every), sum(len(c.usable) for c in every), sum(len(c.wrong) for c in every)
    )  # fmt: skip
    return page("first", "First contact", __doc__, body, headline(trusted, len(every), usable, wrong, *agreeing(every)))


def headline(trusted: int, contacts: int, usable: int, wrong: int, same: int, logs: int) -> str:
    """The result in a sentence."""
    return (
        f"{trusted} of {contacts} contacts end with a trusted fit; of {usable} usable numbers {wrong} "
        f"{'is' if wrong == 1 else 'are'} wrong, and {same} of {logs} logs give the same answer in every dialect."
    )
