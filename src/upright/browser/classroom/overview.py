"""All students at once: one small frame for whoever looks on, a few times a second.

A frame, little-endian: ``u16`` students, ``u32`` late ticks of the class so far; then for each student, in the order of
the list, ``u8`` state (`STATES`), ``u8`` whether somebody operates it, ``i16`` how far the last coordinate is from what
is held [mrad or mm], ``u16`` how long the run has gone on, or went on [s].
"""

from __future__ import annotations

import json
import time

import numpy as np

from upright.browser.classroom.room import Classroom
from upright.browser.messages import HELD
from upright.browser.outbox import Outbox
from upright.browser.station import ENDED, IDLE, RUNNING, STARTING, STOPPED
from upright.errors import BadInput
from upright.rigs.protocol import Fault

RATE = 5.0
"""Frames a second."""
STATES = (IDLE, STARTING, RUNNING, STOPPED, ENDED, "fell", "records")
MOST = 16
"""Who looks on at most."""
_STUDENT = np.dtype([("state", "u1"), ("operated", "u1"), ("away", "<i2"), ("seconds", "<u2")])


def frame(room: Classroom) -> bytes:
    """The class as it is now."""
    students = np.zeros(len(room.stations), dtype=_STUDENT)
    students["away"] = np.clip(np.rint(1e3 * room.away), -32767, 32767)
    for student, station in zip(students, room.stations, strict=True):
        fell = station.state == STOPPED and Fault.OVERTRAVEL in station.last.faults
        records = station.state == RUNNING and station.origin != HELD
        student["state"] = STATES.index("fell" if fell else "records" if records else station.state)
        student["operated"] = bool(station.lease.holder)
        student["seconds"] = min(65535, int(station.last.time))
    head = len(students).to_bytes(2, "little") + min(room.late, 2**32 - 1).to_bytes(4, "little")
    return head + students.tobytes()


class Overview:
    """Those who look on at a class; they stop all of it, and steer nobody."""

    def __init__(self, room: Classroom) -> None:
        self.room = room
        self.clients: set[Outbox] = set()
        self._sent = 0.0

    def join(self) -> Outbox | None:
        """A client more; None where there are too many."""
        if len(self.clients) >= MOST:
            return None
        outbox = Outbox()
        outbox.frame(frame(self.room))
        self.clients.add(outbox)
        return outbox

    def leave(self, outbox: Outbox) -> None:
        """A connection has ended."""
        self.clients.discard(outbox)

    def turn(self) -> None:
        """Send a frame where it is time."""
        if self.clients and (now := time.monotonic()) - self._sent >= 1 / RATE:
            self._sent, content = now, frame(self.room)
            for outbox in self.clients:
                outbox.frame(content)

    def obey(self, text: str) -> None:
        """Do what somebody who looks on asks for.

        Raises
        ------
        BadInput
            When it is not to stop all.
        """
        try:
            wanted = json.loads(text)
        except (ValueError, RecursionError):
            wanted = None
        if wanted != {"do": "stop"}:
            raise BadInput('a class is stopped as a whole, and that is all: {"do": "stop"}.')
        self.room.stop_all("Stopped by the instructor, as everybody was.")
