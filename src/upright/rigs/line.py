"""The line to a board: a serial port or a pty, by the system's own calls on Linux and by pyserial elsewhere."""

from __future__ import annotations

import os
import select
import sys
from typing import Any, Protocol

from upright.errors import BadInput, RigStopped

BAUD = 1_000_000


class Line(Protocol):
    """Bytes to and fro."""

    name: str

    def write(self, data: bytes) -> None:
        """Send all of it."""
        ...

    def read(self, patience: float) -> bytes:
        """What has come, after waiting for it up to a time [s]; empty when nothing came."""
        ...

    def close(self) -> None:
        """Let go of it; may be called twice."""
        ...


class TerminalLine:
    """A serial port or pty on Linux, for one program at a time.

    Parameters
    ----------
    path : str
        Such as ``/dev/ttyACM0`` or ``/dev/pts/4``.
    """

    def __init__(self, path: str) -> None:
        import fcntl
        import termios
        import tty

        self.name = path
        try:
            self._fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as reason:
            raise _no_port(path, reason.strerror) from None
        try:
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
            tty.setraw(self._fd)
            settings: list[Any] = termios.tcgetattr(self._fd)
            settings[4] = settings[5] = termios.B1000000
            settings[2] |= termios.CLOCAL | termios.CREAD
            termios.tcsetattr(self._fd, termios.TCSANOW, settings)
        except BlockingIOError:
            os.close(self._fd)
            raise RigStopped(f"Another program uses {path}; end it first.") from None
        except (termios.error, OSError):
            os.close(self._fd)
            raise BadInput(f"{path} is no serial port; give one such as /dev/ttyACM0.") from None
        self._poll = select.poll()
        self._poll.register(self._fd, select.POLLIN)
        self._open = True

    def write(self, data: bytes) -> None:
        """Send all of it; what the port does not take within 0.1 s is lost, as on a cable that was pulled."""
        while data and self._open:
            try:
                data = data[os.write(self._fd, data) :]
            except BlockingIOError:
                if not select.select([], [self._fd], [], 0.1)[1]:
                    return
            except OSError as reason:
                raise _gone(self.name, reason.strerror) from None

    def read(self, patience: float) -> bytes:
        """What has come."""
        if not self._open or not self._poll.poll(max(0.0, 1e3 * patience)):
            return b""
        try:
            data = os.read(self._fd, 4096)
        except BlockingIOError:
            return b""
        except OSError as reason:
            raise _gone(self.name, reason.strerror) from None
        if not data:
            raise _gone(self.name, "it is at its end")
        return data

    def close(self) -> None:
        """Let go."""
        if self._open:
            self._open = False
            os.close(self._fd)


class PySerialLine:
    """A serial port by pyserial, on Windows and macOS.

    Parameters
    ----------
    path : str
        Such as ``COM4`` or ``/dev/cu.usbmodem1101``.
    """

    def __init__(self, path: str) -> None:
        try:
            import serial
        except ImportError:
            raise BadInput(f"a rig on {path} needs pyserial: pip install 'upright[rig]'.") from None
        self.name = path
        try:
            self._port: Any = serial.Serial(path, BAUD, timeout=0, write_timeout=0.1)
        except (OSError, ValueError) as reason:  # of which SerialException is one
            raise _no_port(path, str(reason)) from None

    def write(self, data: bytes) -> None:
        """Send all of it."""
        try:
            self._port.write(data)
        except OSError as reason:
            raise _gone(self.name, str(reason)) from None

    def read(self, patience: float) -> bytes:
        """What has come."""
        try:
            self._port.timeout = max(0.0, patience)
            data: bytes = self._port.read(1)
            return data + self._port.read(self._port.in_waiting) if data else b""
        except OSError as reason:
            raise _gone(self.name, str(reason)) from None

    def close(self) -> None:
        """Let go."""
        self._port.close()


def open_line(path: str) -> Line:
    """The line of that name."""
    return TerminalLine(path) if sys.platform == "linux" else PySerialLine(path)


def ports() -> dict[str, int]:
    """Serial ports of this machine, each with its USB vendor's number, 0 without one."""
    try:
        from serial.tools.list_ports import comports
    except ImportError:
        raise BadInput("to look for a board, pyserial is needed: pip install 'upright[rig]'.") from None
    return {port.device: port.vid or 0 for port in comports()}


def _no_port(path: str, why: str | None) -> BadInput:
    return BadInput(
        f"the port {path} cannot be opened ({why}); is the board plugged in, and may you use it (group dialout)?"
    )


def _gone(path: str, why: str | None) -> RigStopped:
    return RigStopped(f"The line {path} is gone ({why}); the firmware's watchdog stops the rig. Look at the cable.")
