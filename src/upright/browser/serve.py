"""The bench open for business: its address, its server, and everything at rest before it closes."""

from __future__ import annotations

import atexit
import secrets
import socket
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

from upright.browser.app import application
from upright.browser.classroom.room import Classroom
from upright.browser.classroom.roster import read_roster
from upright.browser.guard import Guard
from upright.browser.messages import LONGEST
from upright.browser.rig import BenchRig, known_rig
from upright.browser.station import Station
from upright.errors import BadInput
from upright.realtime.interrupts import ENDING, ignoring

TWIN = 'kind = "twin"\nname = "furuta"\nmake = "furuta"\n'


class Bench:
    """Rigs in a browser, until it is closed; also as ``with up.bench() as bench:``.

    Attributes
    ----------
    url : str
        Its address; on a network with the token that everybody needs.
    instructor_url : str
        The instructor's own, of a class; the others have `url`.
    rigs : tuple of str
        Names of its rigs.
    lan : bool
        Whether it answers other machines.
    room : Classroom or None
        The class, where there is one.
    folder : Path
        Has the logs and reports of runs, a folder for each rig.
    """

    def __init__(
        self, rigs: Sequence[BenchRig], folder: Path, *, port: int = 0, lan: bool = False,
        room: Classroom | None = None, **of_runs: Any,
    ) -> None:  # fmt: skip
        import uvicorn

        self.folder, self.lan, self.room = folder, lan, room
        self.stations = [
            *(() if room is None else room.stations), *(Station(rig, folder / rig.name, **of_runs) for rig in rigs)
        ]  # fmt: skip
        self.rigs = tuple(station.rig.name for station in self.stations)
        self._socket = _bound(port, lan)
        port = self._socket.getsockname()[1]
        token = secrets.token_urlsafe(24) if lan else ""
        address = _own_address() if lan else "127.0.0.1"
        instructor = secrets.token_urlsafe(24) if room is not None else ""
        self.url = f"http://{address}:{port}/" + (f"?token={token}" if token else "")
        self.instructor_url = f"http://{address}:{port}/?instructor={instructor}" if instructor else ""
        names = {"127.0.0.1", "localhost", *((address, socket.gethostname().lower()) if lan else ())}
        self._guard = Guard(
            application(self.stations, room), hosts=frozenset(f"{n}:{port}" for n in names), token=token,
            instructor=instructor,
        )  # fmt: skip
        app: Any = self._guard
        self._server = uvicorn.Server(
            uvicorn.Config(
                app, loop="asyncio", http="h11", ws="websockets-sansio", ws_max_size=LONGEST, ws_max_queue=8,
                ws_ping_interval=5.0, ws_ping_timeout=5.0, ws_per_message_deflate=False, log_level="warning",
                access_log=False, server_header=False, timeout_graceful_shutdown=2, limit_concurrency=1024,
            )
        )  # fmt: skip
        self._over = threading.Event()  # Python 3.11 takes a thread whose join was interrupted for one that has ended
        threading.Thread(target=self._serve, name="bench", daemon=True).start()
        while not self._server.started and not self._over.wait(0.01):
            pass
        atexit.register(self.close)  # before multiprocessing waits for the loops

    def close(self) -> None:
        """Stop every rig, then the server, whoever is impatient meanwhile."""
        with ignoring(ENDING):
            atexit.unregister(self.close)
            for station in self.stations:
                station.stop("The bench was closed.")
            if self.room is not None:
                self.room.close()
            for station in self.stations:
                station.close()
            self._guard.close()
            self._server.should_exit = True
            if self._over.wait(10.0):  # it closes what it listens to itself, or is still to do it
                self._socket.close()

    def wait(self, seconds: float | None = None) -> None:
        """Wait until it is closed, or for so long [s]."""
        self._over.wait(seconds)

    def _serve(self) -> None:
        try:
            self._server.run(sockets=[self._socket])
        finally:
            self._over.set()

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""
        self.close()

    def __repr__(self) -> str:
        return f"Bench with {', '.join(self.rigs)} at {self.url}"


def open_bench(
    rigs: Sequence[Path], laws: Sequence[Path], folder: Path, *, port: int = 0, lan: bool = False,
    roster: Path | None = None, **of_runs: Any,
) -> Bench:  # fmt: skip
    """A bench of the rigs of some RIG.toml, each with its law; of a twin where there are none.

    Parameters
    ----------
    roster : Path, optional
        Students, each of whom has a twin of the rig to themselves.
    **of_runs
        Options of each `Station`, or of a `Classroom`.

    Raises
    ------
    BadInput
        When a file cannot be used, two rigs have one name, or the port is taken.
    """
    if len(laws) > len(rigs):
        raise BadInput(
            f"there are more laws than rigs, {len(laws)} and {len(rigs)}; name each rig's own, in their order."
        )
    if not rigs:
        folder.mkdir(parents=True, exist_ok=True)
        rigs = [folder / "furuta.toml"]
        rigs[0].write_text(TWIN, encoding="utf-8")
    known = [known_rig(path, law, folder) for path, law in zip(rigs, [*laws, *[None] * len(rigs)], strict=False)]
    names = [rig.name for rig in known]
    if twice := sorted({n for n in names if names.count(n) > 1}):
        raise BadInput(f"two rigs are called '{twice[0]}'; give each a name in its RIG.toml.")
    if roster is None:
        return Bench(known, folder, port=port, lan=lan, **of_runs)
    if len(known) != 1:
        raise BadInput(f"a class has twins of one rig, got {len(known)}; name the one.")
    room = Classroom(known[0], read_roster(roster), folder, **of_runs)
    try:
        return Bench([], folder, port=port, lan=lan, room=room)
    except BaseException:
        room.close()
        raise


def _bound(port: int, lan: bool) -> socket.socket:
    bound = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        bound.bind(("0.0.0.0" if lan else "127.0.0.1", port))
    except OSError as error:
        bound.close()
        raise BadInput(f"port {port} cannot be had ({error.strerror}); name another with --port.") from None
    return bound


def _own_address() -> str:
    """Address of this machine on its network; nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        try:
            asking.connect(("192.0.2.1", 9))
            return str(asking.getsockname()[0])
        except OSError:
            return "127.0.0.1"
