"""What breaks is not the rig but its log: a full disk, a file that ends anywhere."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.hazards.story import Column, Happened, Story
from upright.logs import LogHeader, LogWriter


def full_disk(column: Column) -> Happened:
    """The log's process meets a full disk; the loop goes on, and the end of the run says what is missing."""
    from resource import RLIMIT_FSIZE, prlimit

    story = Story(column)
    story.begin()
    header = LogHeader(
        rig="", law={}, coordinates=(("psi", "rad"), ("theta", "rad")), command_unit="V", period=column.period
    )
    with tempfile.TemporaryDirectory() as name:
        log = LogWriter(Path(name) / "run.mcap", header=header)
        prlimit(log.pid, RLIMIT_FSIZE, (40_000, 40_000))
        for _ in range(round(3.0 / column.period)):
            command, tick = story.beside.step(story.tick), story.tick
            story.tick = story.beside.rig.exchange(command)
            readings = story.beside.readings(tick)
            log.row((tick.time, tick.tick, *tick.counts, *readings, command, story.tick.applied, int(tick.mode), 0))
        status = log.close()
    if not status.dropped:
        raise RuntimeError("the disk was not full")
    return Happened(
        stopped_by="none needed", zero_after=None, arm=0.0, lean=0.0,
        told=f"the loop stands; {status.message} ({status.dropped} rows dropped)",
    )  # fmt: skip


def power_loss(_column: Column) -> Happened:
    """The file of a log ends anywhere; what is read is compared with what was written, row by row."""
    from upright.logs import read_log
    from upright.running.run import RunRequest, run_rig

    rng, left = np.random.default_rng(11), []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "RIG.toml").write_text('kind = "twin"\nmake = "furuta"\nseed = 3\n', encoding="utf-8")
        done = run_rig(RunRequest(rig=folder / "RIG.toml", excite="sine 0.3 1.2", seconds=2.0, check=False), folder)
        whole, data = done.log, done.log_path.read_bytes()
        assert whole is not None
        for _ in range(20):
            torn = folder / "torn.mcap"
            torn.write_bytes(data[: int(rng.integers(len(data) // 4, len(data)))])
            found = read_log(torn)
            for column_name, values in found.columns.items():
                if not np.array_equal(values, whole.columns[column_name][: len(found)]):
                    raise RuntimeError(f"a torn log gave a wrong row in {column_name}")
            left.append(len(found) / len(whole))
    return Happened(
        stopped_by="none needed", zero_after=None, arm=0.0, lean=0.0,
        told=f"20 of 20 torn files read, no wrong row; said to be torn, mended by `upright log recover` "
        f"({100 * min(left):.0f} to {100 * max(left):.0f} % of the rows)",
    )  # fmt: skip
