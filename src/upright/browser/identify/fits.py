"""Logs of a rig, its own and those that somebody brought, and what was identified from them: kept in its folder."""

from __future__ import annotations

import json
import re
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Any

from upright.browser.answers import sentence_of
from upright.browser.identify.bounded import Bounded
from upright.browser.identify.fitted import fitted_rig, fitted_rig_again
from upright.browser.identify.tasks import begin_identification, begin_inspection
from upright.browser.identify.turns import Turn, Turns
from upright.browser.identify.weighing import BodyWeighing
from upright.browser.rig import BenchRig
from upright.browser.runs import listed
from upright.errors import BadInput, UprightError
from upright.files import replace_file

LARGEST = 20 << 20
"""Bytes of a log that somebody brings."""
MOST = 50
"""Logs that somebody brought, at most."""
READING, FITTING, GRACE = 120.0, 900.0, 120.0
"""Time for reading such a log; for a fit until it is interrupted; and for it to write what it has [s]."""
LOOKS = 400
"""Points of the picture of a fit that goes on, at most; of more every second one is left out."""
OWN, COLUMNS = "rig", "columns"
"""Who says what a log is of: what is known of the rig, or its columns."""

Facts = dict[str, Any]


@dataclass(frozen=True, kw_only=True, eq=False)
class Shared:
    """What bounds the identifications of a rig, or of all rigs of a class together.

    Attributes
    ----------
    turns : Turns
        One fit goes on, the others wait.
    reading : Lock
        Of whoever reads a log that was brought.
    seconds : float
        Time for a fit until it is interrupted [s].
    """

    turns: Turns = field(default_factory=Turns)
    reading: threading.Lock = field(default_factory=threading.Lock)
    seconds: float = FITTING


class Identifications:
    """What can be identified at a rig.

    Parameters
    ----------
    carry : callable
        Makes a `Bounded`.
    shared : Shared, optional
        What it shares with others of a class.

    Attributes
    ----------
    came : BenchRig
        The rig as its own RIG.toml describes it.
    """

    def __init__(
        self, rig: BenchRig, folder: Path, carry: Callable[..., Bounded] = Bounded, shared: Shared | None = None
    ) -> None:
        self.came, self._folder, self._carry, self._shared = rig, folder, carry, shared or Shared()
        self._lock = threading.Lock()
        self._job: Bounded | None = None
        self._turn: Turn | None = None
        self._now: Facts | None = None
        self._failed = ""
        self._picture: Facts = {}
        self.weighing = BodyWeighing(carry)

    def keep(self, name: str, data: bytes) -> Facts:
        """Keep a log, once a reader has read it.

        Raises
        ------
        BadInput
            What the reader says; or when there are too many already, or another one is being read.
        """
        name = shown_name(name)
        if len(data) > LARGEST:
            raise BadInput(f"'{name}' has more than {LARGEST >> 20} MB; cut it, or use `upright identify` on it.")
        if not self._shared.reading.acquire(blocking=False):
            raise BadInput("another log is being read; try again when it is there.")
        try:
            folder = self._folder / "uploads"
            taken = [int(p.stem.partition("-")[2]) for p in folder.glob("log-*.json")]
            if len(taken) >= MOST:
                raise BadInput(f"{MOST} logs were brought already; remove some of {folder} where the bench runs.")
            folder.mkdir(parents=True, exist_ok=True)
            key = f"log-{max(taken, default=0) + 1}"
            path = folder / f"{key}.log"
            path.write_bytes(data)
            try:
                text = self._carry(begin_inspection, path, name, seconds=READING).run()
            except BaseException:
                path.unlink()
                raise
            facts = {"id": key, "name": name, "brought": time.time(), **json.loads(text)}
            replace_file(folder / f"{key}.json", json.dumps(facts).encode())
            return facts
        finally:
            self._shared.reading.release()

    def logs(self) -> list[Facts]:
        """Logs that can be identified, those of the rig first, the newest first of each."""
        runs = [
            {"id": run["id"], "own": True, "name": run.get("what", "run"), "started": run["started"],
             "seconds": run["seconds"]}
            for run in listed(self._folder, self.came.name) if "log" in run
        ]  # fmt: skip
        brought = [_read(path) for path in (self._folder / "uploads").glob("log-*.json")]
        return runs + [{**b, "own": False} for b in sorted(brought, key=lambda b: -b["brought"])]

    def begin(self, log: str, of: str, measured: Mapping[str, str]) -> None:
        """Begin to identify a log, of whose rig some numbers were measured.

        Raises
        ------
        BadInput
            When there is no such log, or another one is being identified.
        """
        known = next((each for each in self.logs() if each["id"] == log), None)
        if known is None:
            raise BadInput("there is no such log; load the page again.")
        path = self._folder / (f"{log}.mcap" if known["own"] else f"uploads/{log}.log")
        name = f"{log}.mcap" if known["own"] else known["name"]
        with self._lock:
            if self._now is not None:
                raise BadInput("another log is being identified; wait, or interrupt it.")
            taken = [int(p.name.partition("-")[2]) for p in (self._folder / "fits").glob("fit-*")]
            key = f"fit-{max(taken, default=0) + 1}"
            rig = self.came.file if known["own"] or of == OWN else None
            self._job = self._carry(
                begin_identification, path, name, rig, dict(measured), self._folder / "fits" / key,
                seconds=self._shared.seconds, grace=GRACE, progress=self._progress, show=self._show,
            )  # fmt: skip
            self._turn = self._shared.turns.join()
            self._failed, self._picture = "", {"explained": []}
            self._now = {
                "id": key,
                "log": log,
                "of": OWN if rig is not None else COLUMNS,
                "name": _name(known),
                "step": "starting",
                "since": time.time(),
                "looks": 0,
            }
        threading.Thread(target=self._run, args=(self._job, self._turn, dict(self._now)), name=key, daemon=True).start()

    def interrupt(self) -> None:
        """Let the fit that is on its way end with what it has.

        Raises
        ------
        BadInput
            When there is none.
        """
        with self._lock:
            if self._job is None or self._turn is None or self._now is None:
                raise BadInput("nothing is being identified.")
            if not self._turn.leave_waiting():
                self._now["step"] = "ending with the best so far"
                self._job.interrupt()

    def described(self) -> Facts:
        """Logs, the fit that is on its way and those that are written, as JSON holds them."""
        with self._lock:
            now = None if self._now is None else {**self._now, "seconds": time.time() - self._now["since"]}
            if now is not None and self._turn is not None and (before := self._turn.before):
                now["step"] = f"waiting: {before} fit{'s' * (before > 1)} of the class before it"
            failed = self._failed
        return {"logs": self.logs(), "now": now, "failed": failed, "fits": self.listed()}

    def listed(self) -> list[Facts]:
        """Fits that are written, the newest first."""
        known = [_read(path) for path in (self._folder / "fits").glob("fit-*/fit-*.json")]
        return sorted(known, key=lambda fit: -fit["since"])

    def picture(self) -> Facts | None:
        """What the fit that is on its way has come to: shares explained by evaluation, the best curves so far."""
        with self._lock:
            return None if self._now is None else {"id": self._now["id"], **self._picture}

    def file(self, key: str, name: str) -> Path | None:
        """A file of a fit that is written."""
        there = any(fit["id"] == key for fit in self.listed())
        path = self._folder / "fits" / key / name
        return path if there and path.is_file() else None

    def described_by(self, key: str) -> BenchRig:
        """The rig as a fit describes it; by its own description where the key is empty.

        Raises
        ------
        BadInput
            When there is no such fit, it is not of this rig, or it is not trusted.
        """
        return fitted_rig(self.came, *self._of_rig(key)) if key else self.came

    def described_again(self, key: str) -> BenchRig:
        """The same with the law that was designed when the fit was first used, as strictly."""
        return fitted_rig_again(self.came, *self._of_rig(key)) if key else self.came

    def _of_rig(self, key: str) -> tuple[Path, str]:
        """File of a fit that is of this rig, and what its log is called."""
        fit = next((each for each in self.listed() if each["id"] == key), None)
        if fit is None:
            raise BadInput("there is no such fit; load the page again.")
        if fit["of"] != OWN:
            raise BadInput(
                "this fit is of a rig that the log's columns tell; if the log is of this rig, choose so and identify "
                "it again."
            )
        return self._folder / "fits" / key / "fit.json", fit["name"]

    def close(self) -> None:
        """End what is on its way."""
        self.weighing.close()
        if self._turn is not None:
            self._turn.leave_waiting()
        if self._job is not None:
            self._job.kill()

    def _progress(self, step: str, share: float) -> None:
        with self._lock:
            if self._now is not None:
                self._now["step"] = step

    def _show(self, picture: Facts) -> None:
        with self._lock:
            if self._now is not None:
                point = [picture["evaluations"], picture["explained"]]
                looked = [*self._picture["explained"], point]
                self._picture = {
                    "explained": looked[::2] if len(looked) > LOOKS else looked,
                    "curves": picture.get("curves", self._picture.get("curves", [])),
                }
                self._now["looks"] += 1

    def _run(self, job: Bounded, turn: Turn, now: Facts) -> None:
        failed = ""
        try:
            if not turn.wait():
                raise BadInput("it was taken back before it began.")
            verdict = job.run()
            kept = {**{n: now[n] for n in ("id", "log", "of", "name", "since")}, "verdict": verdict}
            replace_file(self._folder / "fits" / now["id"] / f"{now['id']}.json", json.dumps(kept).encode())
        except UprightError as error:
            failed = sentence_of(error)
        except BaseException:
            failed = "It failed by a fault of the program; see what the server printed."
            raise
        finally:
            turn.leave()
            with self._lock:
                self._now, self._job, self._turn, self._failed = None, None, None, failed


def shown_name(name: str) -> str:
    """What a file is called, for sentences only; never a path."""
    last = re.split(r"[/\\]", name)[-1]
    return "".join(c for c in last if c.isprintable())[:100].strip() or "log"


def _name(log: Facts) -> str:
    if not log["own"]:
        return str(log["name"])
    return f"{log['name']} of {datetime.fromtimestamp(log['started']):%d %b %Y, %H:%M:%S}"


def _read(path: Path) -> Facts:
    facts: Facts = json.loads(path.read_text(encoding="utf-8"))
    return facts
