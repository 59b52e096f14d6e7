"""Firmware in a process of its own: built once, asked by lines what goes wrong, spoken to over its pty."""

from __future__ import annotations

import math
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from upright.rigs.line import Line
from upright.rigs.serial import SerialRig

FIRMWARE = Path(__file__).parents[1] / "firmware"
COUNTS = 16_000 / (2 * math.pi)
FULL_SCALE = 10.0
STEPS = 32768
STEP = FULL_SCALE / STEPS


def build(target: str, folder: Path, needs: str) -> str:
    """Why it cannot be built here; empty when it was."""
    if not sys.platform.startswith("linux"):
        return "the firmware's simulated boards need Linux"
    if missing := [tool for tool in ("make", *needs.split()) if shutil.which(tool) is None]:
        return f"{', '.join(missing)} is missing"
    subprocess.run(["make", "-C", str(FIRMWARE), f"B={folder}", target], check=True, capture_output=True)
    return ""


class Board:
    """A process that behaves like a board."""

    def __init__(self, *command: str | Path) -> None:
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, encoding="utf-8")
        self.port = self._line()

    def _line(self) -> str:
        assert self.process.stdout is not None
        return self.process.stdout.readline().strip()

    def say(self, line: str) -> str:
        """What it answers to a line."""
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        return self._line()

    def do(self, *lines: str) -> None:
        for line in lines:
            assert self.say(line) == "ok", line

    def state(self) -> list[float]:
        """Tick, psi, psi', theta, theta', command [steps], enable line, mode."""
        return [float(number) for number in self.say("state").split()]

    def rig(self, **how: Any) -> SerialRig:
        return rig_on(self.port, **how)

    def close(self) -> None:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        self.process.wait(10)
        self.process.stdout.close()


class PicoLine:
    """The wire of an emulated Pico: what is written is answered before the call ends, in the board's own time."""

    name = "its port"

    def __init__(self, board: Board) -> None:
        self._board, self._data = board, b""

    def write(self, data: bytes) -> None:
        self._data += bytes.fromhex(self._board.say(f"w {data.hex()}").partition(" ")[2])

    def read(self, patience: float) -> bytes:
        data, self._data = self._data, b""
        return data

    def close(self) -> None:
        """It is the board's."""


def pico(folder: Path, drive: str) -> Board:
    """A Raspberry Pi Pico's own image on rp2040js, with a simple rig."""
    return Board("node", FIRMWARE / "picosim.cjs", folder / f"pico-{drive}.uf2", drive)


def no_pico() -> str:
    """Why no Pico can be emulated here: rp2040js is found by NODE_PATH (npm install rp2040js@1.4.1)."""
    if shutil.which("node") is None:
        return "node is missing"
    found = subprocess.run(["node", "-e", 'require("rp2040js")'], capture_output=True, check=False)
    return "rp2040js is missing (npm install rp2040js@1.4.1, and NODE_PATH)" if found.returncode else ""


def rig_on(line: str | Line | Callable[[], Line], **how: Any) -> SerialRig:
    """A rig with ECP's encoders and converter at the end of a line, as patient as a busy machine needs.

    It is greeted alike each time: how long a processor takes over a frame depends on its bytes.
    """
    same: dict[str, Any] = {
        "coordinates": ("psi", "theta"), "counts": (COUNTS, COUNTS), "command_unit": "V", "full_scale": FULL_SCALE,
        "patience": 20.0, "nonce": lambda: 1,
    }  # fmt: skip
    return SerialRig(line, **{**same, **how})


def plant(parameters: Mapping[str, float], gain: float, **start: float) -> list[str]:
    """Arguments of a board with a Furuta pendulum on it."""
    numbers = {
        **{n: parameters[n] for n in ("m_p", "l_cg", "r", "J_d", "J_p", "J_a", "b_1", "b_2", "g")},
        "gain": gain, "step": STEP, "counts_psi": COUNTS, "counts_theta": COUNTS, **start,
    }  # fmt: skip
    return [f"{name}={value!r}" for name, value in numbers.items()]
