"""Those who look on at one rig: each sample is encoded once, and everybody is sent the same bytes."""

from __future__ import annotations

import hmac
import json
import secrets
import time
from typing import Any

from upright.browser.frames import frames, step_of
from upright.browser.outbox import Outbox
from upright.browser.rig import numbers
from upright.browser.station import Station

SECOND = 1.0
BEHIND = 0.25
"""How long a frame is put off at most where this machine is too slow for all of them [s]."""
MOST = 256
"""Clients of a rig at most."""


class Hub:
    """A rig and its clients, by who they are; one may have several connections."""

    def __init__(self, station: Station) -> None:
        self.station = station
        self.clients: dict[Outbox, str] = {}
        self._key = secrets.token_bytes(32)
        self._rig, self._last_use, self._step = station.rig, station.last_use, _step(station)
        self._next, self._late, self._answered, self._followed, self._desk = 0, 0, 0, 0, station.desk
        self._shown: Any = None
        self._scene = self._described()
        self._when = self._sent = 0.0

    def join(self, me: str) -> tuple[str, Outbox] | None:
        """A client, as who they were before where `me` is one that was issued here; None where there are too many."""
        if len(self.clients) >= MOST:
            return None
        who = me if self._issued(me) else self._signed(secrets.token_urlsafe(16))
        outbox = Outbox()
        self.clients[outbox] = who
        self.station.lease.back(who)
        if self.station.rig.still:
            self.station.prepare()  # no page asks for its twin, after which another rig's is prepared
        outbox.note(self._scene_of(who))
        outbox.note(json.dumps(self.station.described(who)))
        return who, outbox

    def _signed(self, name: str) -> str:
        """Who somebody is, in such a way that nobody else can make it up and nothing has to be kept of them."""
        return f"{name}.{hmac.digest(self._key, name.encode(errors='replace'), 'sha256').hex()[:32]}"

    def _issued(self, me: str) -> bool:
        signed = self._signed(me.rpartition(".")[0])
        return hmac.compare_digest(*(text.encode(errors="replace") for text in (signed, me)))

    def operated_by(self, me: str) -> bool:
        """Whether that is who operates the rig."""
        given, holder = (text.encode(errors="replace") for text in (me, self.station.lease.holder))
        return bool(holder) and hmac.compare_digest(given, holder)

    def leave(self, outbox: Outbox) -> None:
        """A connection has ended."""
        who = self.clients.pop(outbox, "")
        if who not in self.clients.values():
            self.station.lease.gone(who)

    def turn(self) -> None:
        """Send what is new."""
        self.station.beat()
        if self.station.rig is not self._rig or self.station.last_use is not self._last_use:
            self._rig, self._last_use, self._step = self.station.rig, self.station.last_use, _step(self.station)
            self._scenes()
        self._samples()
        self._answer()
        self._follow()
        station = self.station
        now_so = (station.state, station.why, station.lease.holder, station.verdict, station.last.phase,
                station.last.mode, station.last.faults, station.hanging, station.writing)  # fmt: skip
        now = time.monotonic()
        if now_so != self._shown or now - self._when >= SECOND:
            self._shown, self._when = now_so, now
            holder = station.lease.holder
            own, others = (json.dumps(station.described(who)) for who in (holder, ""))
            for outbox, who in self.clients.items():
                outbox.note(own if who == holder else others)

    def _samples(self) -> None:
        desk = self.station.desk
        if desk is not self._desk:
            self._desk, self._next, self._late, self._answered, self._followed = desk, 0, 0, 0, 0
            self._scenes()
        if desk is None or not self.clients:
            return
        now = time.monotonic()
        if 2 * sum(outbox.behind for outbox in self.clients) > len(self.clients) and now - self._sent < BEHIND:
            return  # most have not got the last frame yet: the next one holds more
        self._sent = now
        self._next, rows = desk.since(self._next)
        if not len(rows):
            return
        encoders = len(self.station.rig.model.per_unit)
        for frame in frames(rows, encoders, self._step, self._late):
            for outbox in self.clients:
                outbox.frame(frame)
        self._late = int(rows["late"][-1])

    def _answer(self) -> None:
        """What the loop made of the gains that were asked for."""
        station = self.station
        if station.desk is None:
            return
        number, tick, why = station.desk.answered
        if number == self._answered:
            return
        self._answered, loop = number, station.requested
        if why or loop is None:
            self.everybody({"type": "error", "sentence": why})
            return
        station.loop = loop
        poles = station.rig.poles(loop.K)
        self.everybody({"type": "applied", "poles": poles, "K": loop.K[0].tolist(), "at_tick": tick})
        self._scenes()

    def _follow(self) -> None:
        """What the loop follows from some tick on."""
        followed = None if self.station.desk is None else self.station.desk.followed
        if followed is not None and followed[0] != self._followed:
            self._followed = followed[0]
            self._scenes()

    def _scenes(self) -> None:
        self._scene = self._described()
        for outbox, who in self.clients.items():
            outbox.note(self._scene_of(who))

    def _described(self) -> str:
        station = self.station
        rig, K, desk = station.rig, station.gains, station.desk
        changed: dict[str, Any] = {} if K is None else {"poles": rig.poles(K), "K": K[0].tolist()}
        if rig.follows and station.loop is not None:
            changed["law"] = numbers(station.loop.law)
        if desk is not None and (followed := desk.followed) is not None:
            _, reference, tick, target = followed
            changed["reference"] = {"value": reference.size, "shape": reference.shape, "period": reference.period,
                                    "tick": tick, "about": list(target[: len(rig.model.per_unit)])}  # fmt: skip
        last_use = None if station.last_use is None else station.last_use.plain()
        return json.dumps({**rig.scene, **changed, "last_use": last_use})

    def _scene_of(self, who: str) -> str:
        return f'{self._scene[:-1]}, "you": {json.dumps(who)}}}'

    def everybody(self, note: dict[str, Any]) -> None:
        """Send a note to all."""
        text = json.dumps(note)
        for outbox in self.clients:
            outbox.note(text)


def _step(station: Station) -> float:
    return step_of(station.rig.model.limit, station.rig.model.converter)
