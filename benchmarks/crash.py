"""What does a run's log lose when its process is killed, its file is damaged, or its disk is full?

- **Kills.** Several logs record side by side at 1 kHz in real time. Each log's process is killed (`kill -9`) at a
  random moment, and the file is read as it is then. A second series writes rows as fast as they are accepted, so
  that kills land inside writes.
- **Damage.** Files are cut at a random byte, every other one with zeros behind it, or have one random byte changed.
- **Cost.** The time of one row in the loop is measured in real time; the longest are when the machine did other work.

Every row is a function of its number, so a wrong row cannot hide.
"""

from __future__ import annotations

import math
import os
import platform
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.measure import Line, Target, page
from upright.errors import BadInput
from upright.logs import LogHeader, LogWriter, RunLog, read_log
from upright.logs.whole import log_of

PERIOD = 1e-3
HEADER = LogHeader(
    rig='[rig]\nname = "twin"\n', law={}, coordinates=(("psi", "rad"), ("theta", "rad")), command_unit="V",
    period=PERIOD,
)  # fmt: skip
ABREAST, BACKLOG = 8, 4000
_PAUSE = threading.Event()


def row(k: int) -> tuple[float, ...]:
    """Row number k of every log here."""
    psi, theta = round(5000 * math.sin(0.01 * k)), round(900 * math.cos(0.003 * k))
    u = 3.0 * math.sin(0.02 * k)
    return (k * PERIOD, k, psi, theta, psi * 2 * math.pi / 16000, theta * 2 * math.pi / 4096, u, round(u, 2), 2, 0)


def wrong(log: RunLog) -> int:
    """Rows that are not as they were handed over, or not the first ones."""
    there = np.array([row(k) for k in range(len(log))]).reshape(-1, len(log.columns))
    read = np.column_stack([np.asarray(x, dtype=np.float64) for x in log.columns.values()])
    return int((there != read).any(axis=1).sum())


@dataclass(frozen=True, kw_only=True)
class Kill:
    """One log whose process was killed: rows handed over, said to be in the file, read back, wrong; what was said."""

    handed: int
    said: int
    read: int
    wrong: int
    message: str


def kill(log: LogWriter, handed: int) -> tuple[int, int, str]:
    """Kill the process of a log, and go on for 100 rows; rows handed over and said to be written, and what was said."""
    said = log.status().rows
    os.kill(log.pid, signal.SIGKILL)
    for k in range(handed, handed + 100):
        log.row(row(k))
    return handed, said, log.close().message


def left(path: Path, handed: int, said: int, message: str) -> Kill:
    """What the file of a killed log holds."""
    try:
        found = read_log(path)
    except BadInput as error:
        return Kill(handed=handed, said=said, read=-1, wrong=0, message=str(error))
    return Kill(handed=handed, said=said, read=len(found), wrong=wrong(found), message=message)


def paced(folder: Path, kills: int, seed: int) -> list[Kill]:
    """Kills of logs that are fed at 1 kHz side by side, each after 0.2 to 1.2 s; read when none is fed any more."""
    rng, done = random.Random(seed), []
    for first in range(0, kills, ABREAST):
        paths = [folder / f"{k}.mcap" for k in range(first, min(first + ABREAST, kills))]
        running = {path: LogWriter(path, header=HEADER) for path in paths}
        ends = {path: rng.uniform(0.2, 1.2) for path in paths}
        ended: dict[Path, tuple[int, int, str]] = {}
        begin, handed = time.perf_counter(), 0
        while running:
            now = time.perf_counter() - begin
            for k in range(handed, math.floor(now / PERIOD)):
                for log in running.values():
                    log.row(row(k))
                handed = k + 1
            for path in [path for path in running if ends[path] <= now]:
                ended[path] = kill(running.pop(path), handed)
            _PAUSE.wait(PERIOD / 2)
        done += [left(path, *ended[path]) for path in paths]
    return done


def busy(folder: Path, kills: int, seed: int) -> list[Kill]:
    """Kills of a log that is fed as fast as it takes rows, after 0.05 to 0.3 s."""
    rng, done = random.Random(seed), []
    for number in range(kills):
        path = folder / f"busy{number}.mcap"
        log, end, k = LogWriter(path, header=HEADER), time.perf_counter() + rng.uniform(0.05, 0.3), 0
        while time.perf_counter() < end:
            if k - log.status().rows < BACKLOG:
                for n in range(k, k + 100):
                    log.row(row(n))
                k += 100
        done.append(left(path, *kill(log, k)))
    return done


def loops_killed(folder: Path, kills: int) -> list[int]:
    """Rows that are missing after the loop's own process was killed, right behind its last row."""
    code = (
        "import os, signal, sys; from benchmarks.crash import *; log = LogWriter(sys.argv[1], header=HEADER)\n"
        "for k in range(int(sys.argv[2])): log.row(row(k))\n"
        "os.kill(os.getpid(), signal.SIGKILL)"
    )
    missing = []
    for n in range(kills):
        path, rows = folder / f"loop{n}.mcap", 500 + 37 * n
        subprocess.run([sys.executable, "-c", code, str(path), str(rows)], check=False)
        while read_log(path).complaint:
            _PAUSE.wait(0.01)
        found = read_log(path)
        missing.append(rows - len(found) + wrong(found))
    return missing


def whole_file(folder: Path, rows: int) -> bytes:
    """Bytes of a log that was closed."""
    path = folder / "whole.mcap"
    with LogWriter(path, header=HEADER) as log:
        for k in range(rows):
            log.row(row(k))
    return path.read_bytes()


def damaged(rows: int, trials: int, harm: Callable[[random.Random], bytes]) -> tuple[int, int, list[float]]:
    """Files read, wrong rows in all of them, and the share of rows that each gave."""
    rng, shares, bad, read = random.Random(5), [], 0, 0
    for _ in range(trials):
        try:
            found = log_of(harm(rng), "damaged")
        except BadInput:
            shares.append(0.0)
            continue
        read += 1
        bad += wrong(found)
        shares.append(len(found) / rows)
    return read, bad, shares


@contextmanager
def small_disk() -> Generator[tuple[Path, str]]:
    """A folder on a disk of 1 MB where one can be mounted; else a folder, to be limited by the process."""
    with tempfile.TemporaryDirectory() as folder:
        mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", folder]
        try:
            mounted = sys.platform == "linux" and not subprocess.run(mount, capture_output=True).returncode
        except OSError:
            mounted = False
        try:
            yield Path(folder), "a tmpfs of 1 MB" if mounted else "RLIMIT_FSIZE of 1 MB"
        finally:
            if mounted:
                subprocess.run(["umount", "-l", folder], check=False)


def full(rows: int) -> tuple[str, str, int, int, int]:
    """On what, what was said, rows said to be in the file, read and wrong, where the disk takes 1 MB."""
    with small_disk() as (folder, what):
        path = folder / "run.mcap"
        log = LogWriter(path, header=HEADER, rows=1 << 16)
        if what.startswith("RLIMIT"):
            from resource import RLIMIT_FSIZE, prlimit

            prlimit(log.pid, RLIMIT_FSIZE, (1 << 20, 1 << 20))
        for k in range(rows):
            log.row(row(k))
            if k % 1000 == 999:
                _PAUSE.wait(0.01)
        status = log.close()
        found = read_log(path)
        return what, status.message, status.rows, len(found), wrong(found)


def cost(folder: Path, seconds: float) -> tuple[np.ndarray, float, float]:
    """Seconds of each `row` at 1 kHz, share of a processor that the other process takes, bytes of a row."""
    path, taken = folder / "cost.mcap", []
    log = LogWriter(path, header=HEADER)
    used, begin = _cpu(log.pid), time.perf_counter()
    k = 0
    while (now := time.perf_counter() - begin) < seconds:
        if now / PERIOD > k:
            sample, start = row(k), time.perf_counter()
            log.row(sample)
            taken.append(time.perf_counter() - start)
            k += 1
        else:
            _PAUSE.wait(PERIOD / 4)
    share = (_cpu(log.pid) - used) / seconds
    log.close()
    return np.array(taken), share, path.stat().st_size / k


def _cpu(pid: int) -> float:
    """CPU seconds of a process; not known where there is no /proc."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return math.nan
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def kill_line(name: str, kills: Sequence[Kill], *, timed: bool) -> Line:
    """What a series of kills came to; the time that rows cover which are lost, where they come at 1 kHz."""
    lost = np.array([kill.handed - kill.read for kill in kills])
    readable = sum(kill.read >= 0 for kill in kills)
    bad, broken = sum(kill.wrong for kill in kills), sum(kill.read < kill.said for kill in kills)
    told = sum("the loop goes on" in kill.message for kill in kills)
    worst = float(lost.max()) * PERIOD if not (bad or broken or readable < len(kills)) else math.inf
    note = (
        f"readable {readable} of {len(kills)}; rows lost: median {np.median(lost):.0f}, most {lost.max()}; wrong rows "
        f"{bad}; logs that lost a row which status() had reported as written {broken}; reported to the loop {told}"
    )
    if not timed:
        return Line(contender=name, note=f"{note}; up to {BACKLOG} rows waited in the ring, lost with the process")
    return Line(contender=name, seconds=(worst, worst, worst), target=Target(most=0.1, of="seconds"), note=note)


def run(*, quick: bool, progress: Callable[[str], None], markdown: Path | None = None) -> list[Line]:
    """Kills of the log's process and of the loop's, torn and changed files, a full disk, and what a row costs."""
    kills, trials = (16, 60) if quick else (200, 500)
    lines: list[Line] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        progress(f"{kills} kills at 1 kHz, {ABREAST} at a time")
        lines.append(kill_line("log's process killed at 1 kHz", paced(folder, kills, 1), timed=True))
        progress("kills while rows come as fast as they are taken")
        lines.append(kill_line("log's process killed, rows as fast as taken", busy(folder, kills // 4, 2), timed=False))
        progress("kills of the loop")
        missing = loops_killed(folder, kills // 10)
        note = f"{len(missing)} times, right behind the last row; rows missing or wrong: {sum(missing)}"
        lines.append(Line(contender="loop's process killed", note=note))
        progress("torn and changed files")
        rows = 2000
        data = whole_file(folder, rows)
        harms: dict[str, Callable[[random.Random], bytes]] = {
            "file cut at a random byte": lambda rng: _cut(data, rng),
            "one random byte changed": lambda rng: _changed(data, rng),
        }
        for what, harm in harms.items():
            read, bad, shares = damaged(rows, trials, harm)
            note = (
                f"{trials} files of {rows} rows: rows from {read}, refused {trials - read}; wrong rows {bad}; "
                f"median of the rows kept {100 * float(np.median(shares)):.0f} %"
            )
            lines.append(Line(contender=what, error=float(bad), note=note))
        progress("a full disk")
        if sys.platform == "linux":
            on, message, said, there, bad = full(30_000)
            note = f'on {on}: "{message}"; rows reported as written {said}, read {there}, wrong {bad}; the loop ran on'
            lines.append(Line(contender="disk full", error=float(bad), note=note))
        else:
            lines.append(Line(contender="disk full", note="left out: needs tmpfs or prlimit of Linux"))
        progress("what a row costs")
        taken, share, size = cost(folder, 3.0 if quick else 20.0)
        middle, low, high = np.percentile(taken, [50, 25, 75]).tolist()
        rare, longest = (1e6 * float(value) for value in (np.percentile(taken, 99.9), taken.max()))
        note = (
            f"99.9 % below {rare:.0f} us, longest {longest:.0f} us; "
            f"the log's process takes {100 * share:.1f} % of a processor at 1 kHz; {size:.0f} bytes a row"
        )
        lines.append(Line(contender="LogWriter.row in the loop", seconds=(middle, low, high), note=note))
    if markdown is not None:
        table = [f"| {x.contender} | {_seconds(x)} | {x.note} |" for x in lines]
        machine = (
            f"{os.cpu_count()} processors ({platform.machine()}) shared with others, Python {platform.python_version()}"
        )
        head = ["", f"Measured on {machine}.", "", "| | worst loss, or median | |", "|---|---|---|"]
        result = headline(_seconds(lines[0]), round(sum(x.error or 0 for x in lines)))
        markdown.write_text(page("crash", "Logs that end badly", __doc__, [*head, *table], result), encoding="utf-8")
    return lines


def headline(lost: str, wrong: int) -> str:
    """The result in a sentence."""
    return (
        f"A log whose process was killed at 1 kHz lost at most its last {lost}, and {wrong} wrong rows were read from "
        "damaged files or a full disk."
    )


def _cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data))] + bytes(rng.choice((0, rng.randrange(1, 4096))))


def _changed(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    changed[rng.randrange(len(data))] ^= rng.randrange(1, 256)
    return bytes(changed)


def _seconds(line: Line) -> str:
    if line.seconds is None:
        return ""
    value = line.seconds[0]
    return f"{1e3 * value:.0f} ms" if value >= 1e-3 else f"{1e6 * value:.1f} us"
