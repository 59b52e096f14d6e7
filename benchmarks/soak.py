"""Does a supervised loop last an hour at 1 kHz with a fault every few seconds, and lose nothing?

Twins of both pendulums are stabilised upright in virtual time by the sampled controller, each under its supervisor,
with its log written by a process of its own. Every 2 to 8 s a fault is drawn from a seed: an encoder dies, counts
backwards, twice or four times as far, or loses counts; the host falls silent or sends no number; somebody requests a
stop; the pendulum is hit. Then the rig is brought back and started again. The firmware's host port goes through the
same in lockstep, under its own limits alone, with the loop on the host and on the microcontroller in turn.

Counted, and required:

- stops that left a command or the power stage on: none
- faults that were neither stopped nor outlived within 5 s, and stops without a fault
- rows of the log, or samples, against ticks of the rig: all (of the firmware, a sample that does not follow on from the
  one before it, as after each silence of the host, is no row)
- memory and open files of the process at the end against those after its first tenth: none lost

Frames are corrupted by the million on their way to the host's parser: bytes changed, lost, doubled, cut short, run
together. A frame that was never sent and is accepted is counted (required: none). LibFuzzer, with its address and
undefined-behaviour sanitizers, feeds the firmware a million inputs, healthy frames among them.
"""

from __future__ import annotations

import gc
import math
import os
import random
import re
import subprocess
import tempfile
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks import boards
from benchmarks.designs import GAIN, LIMITS, PARAMETERS, inverted
from benchmarks.measure import Line, of_each
from benchmarks.rigs import publish
from upright.errors import RigStopped
from upright.gains import feedback, filtered, place
from upright.laws import Law
from upright.logs import LogHeader, LogWriter, read_log
from upright.rig.makes import make_rig
from upright.rigs import Board, Limits, Mode, TwinPort, wire
from upright.rigs.law import RunningLaw
from upright.rigs.serial import SerialRig
from upright.rigs.supervisor import Duty, Supervisor
from upright.rigs.twin import BrokenEncoders
from upright.workers import HERE, Workers

SESSION = 300.0  # s of virtual time
PATIENCE = 5.0  # s
GONE = 0.9  # rad from upright at which nobody would say that it is held
KINDS = {"furuta": (2.0, 40.0), "linear": (0.15, 4.0)}
"""Rigs, and how far and fast the driven body may go [rad or m, and per s]."""
POLES = {
    "furuta": [-4.1484 + 1.6341j, -4.1484 - 1.6341j, -16.8545, -3.2220],
    "linear": [-4.0 + 2.0j, -4.0 - 2.0j, -12.0, -3.0],
}


class Witness(TwinPort):
    """A twin's board that remembers what it puts out."""

    command, on = 0.0, False

    def write(self, command: float) -> None:
        self.command = command
        super().write(command)

    def enable(self, on: bool) -> None:
        self.on = on
        super().enable(on)


def _silence(rig: Board, _port: Witness) -> None:
    rig.alone(0.1)


def _no_number(rig: Board, _port: Witness) -> None:
    rig.exchange(math.nan)


FAULTS: dict[str, Callable[[Board, Witness], None]] = {
    "pendulum encoder dead": lambda _, port: port.encoders.dead(1),
    "base encoder dead": lambda _, port: port.encoders.dead(0),
    "pendulum encoder backwards": lambda _, port: port.encoders.scaled(1, -1.0),
    "base encoder backwards": lambda _, port: port.encoders.scaled(0, -1.0),
    "pendulum encoder twice": lambda _, port: port.encoders.scaled(1, 2.0),
    "pendulum encoder four times": lambda _, port: port.encoders.scaled(1, 4.0),
    "pendulum encoder loses 2000 counts": lambda _, port: port.encoders.lost(1, 2000),
    "host silent for 0.1 s": _silence,
    "a command that is no number": _no_number,
    "pendulum hit": lambda _, port: port.push([0.0, 15.0]),
    "stop asked": lambda _, port: None,
}


@dataclass(kw_only=True)
class Outcome:
    """What came of one session."""

    ticks: int = 0
    rows: int = 0
    dropped: int = 0
    done: Counter[str] = field(default_factory=Counter[str])
    stopped: Counter[str] = field(default_factory=Counter[str])
    outlived: Counter[str] = field(default_factory=Counter[str])
    late: dict[str, float] = field(default_factory=dict[str, float])
    farthest: float = 0.0
    still_on: int = 0
    unasked: list[str] = field(default_factory=list[str])
    unnoticed: list[str] = field(default_factory=list[str])
    grown: int = 0
    files: int = 0


def law_of(kind: str) -> Law:
    """State feedback with filtered speeds, by poles about upright."""
    rig = make_rig(kind)
    model = rig.linear("inverted")
    sampled = model.to_sampled(rig.period, rig.delay / rig.period)
    return feedback(filtered(sampled, 0.5), place(model.A, model.B, POLES[kind]).K)


def session(which: tuple[str, int, float]) -> Outcome:
    """One session of a kind of rig, with a seed, for so many seconds."""
    kind, seed, seconds = which
    rng = np.random.default_rng([seed, 12])
    model, out, law = make_rig(kind), Outcome(), law_of(kind)
    truth = make_rig(kind, seed + 1)
    port = Witness(truth)
    rig = Board(port)
    travel, speed = KINDS[kind]
    limits = Limits(travel=(travel, math.inf), speed=(speed, 60.0), start=(travel, math.inf), command=model.limit)
    duty = Duty(limits=limits, model=model, at="inverted", zero="hanging", lean=math.radians(25), near=math.radians(10))
    names = tuple(c.name for c in truth.plant.coordinates)
    header = LogHeader(
        rig=f"twin of {truth.name}", law={}, coordinates=tuple((c.name, c.unit) for c in truth.plant.coordinates),
        command_unit=truth.unit, period=truth.period,
    )  # fmt: skip
    first = (0, 0)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "soak.mcap"
        with LogWriter(path, header=header, rows=1 << 15) as log:
            while out.ticks * truth.period < seconds:
                if not first[0] and out.ticks * truth.period > 0.1 * seconds:
                    first = _memory(), _files()
                _bout(rig, port, duty, law, rng, out, log, names)
            out.grown, out.files = (_memory() - first[0], _files() - first[1]) if first[0] else (0, 0)
        status = log.status()
        out.rows, out.dropped = len(read_log(path)), status.dropped
    return out


def _bout(
    rig: Board, port: Witness, duty: Duty, law: Law, rng: np.random.Generator, out: Outcome, log: LogWriter,
    names: tuple[str, ...],
) -> None:  # fmt: skip
    """From a start to a stop."""
    wish = [""]
    beside = Supervisor(rig, duty, event=log.event, stopped=lambda: wish[0])
    port.encoders = BrokenEncoders(len(names))
    port.hold("hanging")
    beside.prepare()
    port.hold("inverted", [0.0, 0.0, float(rng.normal() * 0.02), 0.0])
    what, at = "", 0.0
    try:
        beside.aim(law)
        beside.start()
        port.let_go()
        tick = rig.exchange(0.0)
        at = tick.time + float(rng.uniform(2, 8))
        while True:
            command = beside.step(tick)
            tick = rig.exchange(command)
            out.ticks += 1
            readings = beside.readings(tick)
            log.row((tick.time, tick.tick, *tick.counts, *readings, command, tick.applied, tick.mode, tick.faults))
            lean = abs(math.remainder(float(port.x[2]) - math.pi, math.tau))
            if not what and tick.time >= at:
                what, at = str(rng.choice(list(FAULTS))), tick.time
                out.done[what] += 1
                wish[0] = "somebody asked" if what == "stop asked" else ""
                FAULTS[what](rig, port)
            elif what and port.on:
                out.farthest = max(out.farthest, lean)
                if tick.time - at > PATIENCE:
                    (out.outlived.update([what]) if lean < GONE else out.unnoticed.append(what))
                    beside.finish()
                    return
    except RigStopped as error:
        if port.on or port.command:
            out.still_on += 1
        if not what:
            out.unasked.append(str(error))
            return
        out.stopped[what] += 1
        out.late[what] = max(out.late.get(what, 0.0), rig.sample.time - at)


def firmware_session(which: tuple[Path, int, float]) -> Outcome:
    """One session of the firmware in the folder where it was built, with a seed, for so many seconds."""
    folder, seed, seconds = which
    rng = np.random.default_rng([seed, 21])
    out, first = Outcome(), (0, 0)
    board = boards.Board(folder / "rig-host", "lockstep", *boards.plant(PARAMETERS, GAIN, theta=math.pi))
    rig = board.rig(patience=20.0)
    about = rig.open()
    rig.clear_fault()
    rig.configure(LIMITS)
    try:
        while out.ticks * about.period < seconds:
            if not first[0] and out.ticks * about.period > 0.1 * seconds:
                first = _memory(), _files()
            _onboard_bout(board, rig, about.period, rng, out)
        out.grown, out.files = (_memory() - first[0], _files() - first[1]) if first[0] else (0, 0)
    finally:
        rig.close()
        board.close()
    return out


ONBOARD = {
    "pendulum encoder dead": "dead 1", "base encoder dead": "dead 0", "pendulum encoder backwards": "flip 1",
    "base encoder backwards": "flip 0", "pendulum encoder twice": "scale 1 2",
    "pendulum encoder four times": "scale 1 4",
    "pendulum encoder loses 2000 counts": "lose 1 2000", "host silent for 0.1 s": "run 100",
    "pendulum hit": "kick 15", "an illegal quadrature transition": "illegal", "a tick that overran": "overrun",
    "a command that is no number": "", "stop asked": "",
}  # fmt: skip


def _onboard_bout(board: boards.Board, rig: SerialRig, period: float, rng: np.random.Generator, out: Outcome) -> None:
    """From a start to a stop, under the firmware's limits alone."""
    board.do("alive 0", "alive 1", "scale 0 1", "scale 1 1", f"put 0 0 {math.pi!r} 0", "run 64")
    board.do(f"put 0 0 {math.pi + 0.02 * rng.normal()!r} 0", "run 1")
    rig.clear_fault()
    rig.zero()
    rig.arm()
    mode = Mode.MCU if rng.random() < 0.5 else Mode.HOST
    law = inverted()
    rig.start(mode, law if mode == Mode.MCU else None)
    running, command, what = RunningLaw(law, period), 0.0, ""
    before = rig.exchange(0.0)
    at = before.time + float(rng.uniform(2, 8))
    while True:
        tick = rig.exchange(command)
        out.ticks += 1
        out.rows += tick.tick == before.tick + 1
        out.dropped += what != "host silent for 0.1 s" and tick.tick != before.tick + 1
        before = tick
        if tick.mode != mode:
            _, _, _, _, _, put, on, _ = board.state()
            out.still_on += bool(put or on)
            if what:
                out.stopped[what] += 1
                out.late[what] = max(out.late.get(what, 0.0), tick.time - at)
            else:
                out.unasked.append(str(tick.faults))
            return
        if mode == Mode.HOST:
            command = running.step([n / boards.COUNTS for n in tick.counts])
        if not what and tick.time >= at:
            what, at = str(rng.choice(list(ONBOARD))), tick.time
            out.done[what] += 1
            if ONBOARD[what]:
                board.do(ONBOARD[what])
            elif what == "stop asked":
                rig.estop()
            else:
                command = math.nan
        elif what and tick.time - at > PATIENCE:
            lean = abs(math.remainder(board.state()[3] - math.pi, math.tau))
            (out.outlived.update([what]) if lean < GONE else out.unnoticed.append(what))
            rig.stop()
            return


def fuzzed(which: tuple[int, int]) -> tuple[int, int, int]:
    """Frames sent, accepted, and accepted although nobody sent them, of a seed and a number of frames."""
    seed, number = which
    rng = random.Random(seed)
    parser, sent, accepted, wrong = wire.Parser(), set[bytes](), 0, 0
    for _ in range(number // 100):
        frames = [
            wire.pack(rng.randrange(256), rng.randrange(256), rng.randrange(65536), rng.randbytes(rng.randrange(80)))
            for _ in range(100)
        ]
        sent = {frame[:-1] for frame in frames}
        stream = b"".join(_spoiled(frame, rng) for frame in frames) + b"\0"
        for frame in parser.feed(stream):
            accepted += 1
            wrong += wire.pack(*frame)[:-1] not in sent
    return number, accepted, wrong


def _spoiled(frame: bytes, rng: random.Random) -> bytes:
    data, how = bytearray(frame), rng.randrange(8)
    at = rng.randrange(len(data))
    if how < 3:
        data[at] ^= 1 << rng.randrange(8)
    elif how == 3:
        data[at] = rng.randrange(256)
    elif how == 4:
        del data[at]
    elif how == 5:
        data.insert(at, rng.randrange(256))
    elif how == 6:
        del data[at:]
    return bytes(data)


def _libfuzzer(runs: int) -> Line:
    name = "the firmware under libFuzzer"
    with tempfile.TemporaryDirectory() as folder:
        if reason := boards.build("fuzz", Path(folder), "clang"):
            return Line(contender=name, note=f"left out: {reason}")
        done = subprocess.run(
            [Path(folder) / "fuzz-wire", f"-runs={runs}", "-seed=1", "-max_len=1000"], capture_output=True, text=True,
            cwd=folder, check=False,
        )  # fmt: skip
    told = done.stderr.strip().splitlines()
    covered = next((line for line in reversed(told) if "cov:" in line), "")
    note = f"{runs} inputs, {'no crash' if done.returncode == 0 else 'CRASHED: ' + told[-1]}; {covered[:60].strip()}"
    return Line(contender=name, note=note)


def _memory() -> int:
    """Resident bytes of this process; 0 where nobody says."""
    gc.collect()
    try:
        return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        return 0


def _files() -> int:
    try:
        return len(os.listdir("/proc/self/fd"))
    except OSError:
        return 0


def run(
    *, quick: bool, progress: Callable[[str], None], markdown: Path | None = None, workers: Workers = HERE
) -> list[Line]:
    """Lines of each rig, of each fault, and of frames."""
    lines: list[Line] = []
    every: list[Outcome] = []
    seconds, each, frames = (10.0, 1, 5_000) if quick else (SESSION, 12, 1_000_000)
    for kind in KINDS:
        progress(f"{each} sessions of {seconds:g} s on twins like {kind}")
        done, _ = of_each(session, [(kind, k, seconds) for k in range(each)], workers)
        every += done
        lines.append(_line(f"twins like {kind}", make_rig(kind).period, done))
    lines += [_of_fault(what, every) for what in FAULTS]
    with tempfile.TemporaryDirectory() as folder:
        if reason := boards.build("host", Path(folder), "cc"):
            lines.append(Line(contender="firmware, host port", note=f"left out: {reason}"))
        else:
            progress(f"{each} sessions of {seconds:g} s on the firmware")
            done, _ = of_each(firmware_session, [(Path(folder), k, seconds) for k in range(each)], workers)
            lines.append(_line("firmware, host port", 1e-3, done))
            lines += [_of_fault(what, done, "firmware: ") for what in ONBOARD]
    progress(f"{frames} frames")
    counted, _ = of_each(fuzzed, [(k, frames // 4) for k in range(4)], workers)
    sent, accepted, wrong = (sum(numbers) for numbers in zip(*counted, strict=True))
    note = f"{sent} frames, 7 of 8 spoiled; accepted {accepted}, of those nobody sent {wrong} (0)"
    lines.append(Line(contender="the host's parser", note=note))
    lines.append(_libfuzzer(frames))
    if markdown is not None:
        publish(markdown, "soak", "Soak", __doc__, lines, headline(lines))
    return lines


def headline(lines: Sequence[Line]) -> str:
    """The result in a sentence, from the lines of the rigs."""
    rigs = [line.note for line in lines if "ticks" in line.note]
    hours, faults, on, lost = (
        sum(float(re.search(pattern, note)[1]) for note in rigs)  # type: ignore[index]
        for pattern in (r"([\d.]+) h,", r"(\d+) faults", r"stage on: (\d+)", r"lost (\d+)")
    )
    unseen = sum("outlived: none" not in note for note in rigs)
    return (
        f"In {hours:.2f} hours with {faults:.0f} faults the output stayed on {on:.0f} times after a stop, "
        f"{lost:.0f} rows were lost, and "
        + ("no fault went unnoticed." if not unseen else f"faults went unnoticed on {unseen} of {len(rigs)} rigs.")
    )


def _line(name: str, period: float, done: list[Outcome]) -> Line:
    ticks, rows, dropped = (sum(getattr(o, n) for o in done) for n in ("ticks", "rows", "dropped"))
    faults, on = (sum(sum(o.done.values()) for o in done), sum(o.still_on for o in done))
    unasked = [why for o in done for why in o.unasked]
    unnoticed = Counter(what for o in done for what in o.unnoticed)
    told = [
        f"{ticks * period / 3600:.2f} h, {ticks} ticks, {faults} faults",
        f"told with a command or the power stage on: {on} (0)",
        "neither stopped nor outlived: " + (", ".join(f"{n} {what}" for what, n in unnoticed.items()) or "none"),
        f"stops without a fault: {len(unasked)}" + (f" ({unasked[0]})" if unasked else ""),
        f"rows {rows}, lost {dropped}",
        f"memory grew by {max(o.grown for o in done) / 1e6:.1f} MB at most, open files by {max(o.files for o in done)}",
    ]
    return Line(contender=name, note="; ".join(told))


def _of_fault(what: str, every: list[Outcome], of: str = "") -> Line:
    done, stopped, outlived = (sum(getattr(o, n)[what] for o in every) for n in ("done", "stopped", "outlived"))
    late = 1e3 * max((o.late.get(what, 0.0) for o in every), default=0.0)
    note = f"{done} times, stopped {stopped}, at most {late:.0f} ms later; held on with it {outlived}"
    return Line(contender=of + what, note=note)
