"""How large is the firmware on each board, how long its longest tick, and does it keep every rule of the protocol?

Firmware runs in a process of its own: built once, asked by lines what goes wrong, spoken to over its pty. Of the Mega
simavr counts the cycles of its 16 MHz; rp2040js counts a Pico's instructions without the waits of its flash, which is
no evidence of time.
"""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from upright.rigs.line import Line
from upright.rigs.serial import SerialRig

if TYPE_CHECKING:
    from benchmarks.measure import Line as Row

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


SUITES = {
    "twin": ("tests/rigs/test_conformance.py", "Furuta"),
    "firmware as a process": (
        "tests/firmware/test_conformance.py",
        "TestFirmware and not analog and not pair and not sign",
    ),
    "Mega, analog": ("tests/firmware/test_conformance.py", "TestFirmware and analog"),
    "Mega, pair": ("tests/firmware/test_conformance.py", "TestFirmware and pair"),
    "Mega, sign": ("tests/firmware/test_conformance.py", "TestFirmware and sign"),
    "Pico, pair": ("tests/firmware/test_conformance.py", "TestPico and pair"),
    "Pico, sign": ("tests/firmware/test_conformance.py", "TestPico and sign"),
}
"""Where the rules of the protocol are asked of which rig."""
_CLOCK, _TICK = 16e6, 16_000


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Row]:
    """A row for each image with its longest tick, and one for each rig that the rules are asked of."""
    from benchmarks.measure import Line as Row

    lines: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="upright-firmware-") as name:
        folder = Path(name)
        if reason := build("avr", folder, "avr-gcc") or build("simrig", folder, "cc simavr"):
            lines.append(Row(contender="Mega", note=f"left out: {reason}"))
        else:
            lines += [_of_mega(folder, drive, quick, progress) for drive in ("analog", "pair", "sign")]
        if reason := build("pico", folder, "arm-none-eabi-gcc") or no_pico():
            lines.append(Row(contender="Pico", note=f"left out: {reason}"))
        else:
            lines += [_of_pico(folder, drive) for drive in ("pair", "sign")]
    for rig, (file, which) in SUITES.items():
        progress(rig)
        lines.append(Row(contender=f"rules of the protocol, {rig}", note=_rules(file, which)))
    return lines


def _size(tool: str, image: Path) -> str:
    text, data, bss = subprocess.run([tool, image], capture_output=True, text=True, check=True).stdout.split()[6:9]
    return f"{(int(text) + int(data)) / 1e3:.1f} kB of flash, {(int(data) + int(bss)) / 1e3:.1f} kB of memory"


def _of_mega(folder: Path, drive: str, quick: bool, progress: Callable[[str], None]) -> Row:
    """Held through kicks by both loops, the wire and encoders busy."""
    from benchmarks.designs import GAIN, PARAMETERS, inverted
    from benchmarks.measure import Line as Row
    from benchmarks.measure import Target
    from benchmarks.minute import held
    from upright.rigs import Mode

    longest = {}
    for mode in (Mode.MCU, Mode.HOST):
        progress(f"{drive}, {mode.name}")
        bridge = [] if drive == "analog" else [drive, f"step={12.0 / 800!r}"]
        upright = plant(PARAMETERS, GAIN, theta=math.pi)
        board = Board(folder / "simrig", folder / f"atmega2560-{drive}.elf", *upright, *bridge)
        held(board, mode, inverted(), 1.0 if quick else 5.0, {0.5: 0.6, 2.0: -0.9}, lockstep=True,
             **({"full_scale": 12.0} if bridge else {}))  # fmt: skip
        longest[mode] = board.state()[7]
        board.close()
    worst = max(longest.values()) / _CLOCK
    return Row(
        contender=f"Mega, {drive}", seconds=(worst, worst, worst),
        target=Target(most=0.7 * _TICK / _CLOCK, of="seconds"),
        note=f"{_size('avr-size', folder / f'atmega2560-{drive}.elf')}; longest tick {longest[Mode.MCU]:.0f} "
        f"of {_TICK} cycles with the law on the board, {longest[Mode.HOST]:.0f} on the host",
    )  # fmt: skip


def _of_pico(folder: Path, drive: str) -> Row:
    from benchmarks.designs import PERIOD
    from benchmarks.measure import Line as Row
    from upright.laws import state_feedback
    from upright.rigs import Limits, Mode

    board = pico(folder, drive)
    rig = rig_on(PicoLine(board), lockstep=True, full_scale=12.0)
    rig.open()
    rig.clear_fault()
    rig.configure(Limits(travel=(9.0, 9.0), speed=(48.0, 48.0), start=(1.0, 1.0), command=9.0, watchdog=0.02))
    rig.arm()
    rig.start(Mode.MCU, state_feedback([-0.8, -0.03, 0.5, 0.02], PERIOD, memory=0.5, target=[0.3, 0.1]))
    for _ in range(200):
        rig.exchange(0.0)
    cycles = board.state()[7]
    board.close()
    return Row(
        contender=f"Pico, {drive}",
        note=f"{_size('arm-none-eabi-size', folder / f'pico-{drive}.elf')}; longest tick {cycles:.0f} "
        "of 125,000 cycles in the emulator, which knows no wait for the flash",
    )


def _rules(file: str, which: str) -> str:
    """How many of them are kept."""
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-n", "0", "-m", "", "--tb=no", "-k", which, file],
        cwd=FIRMWARE.parent, env={**os.environ, "MPLBACKEND": "Agg"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    counted = re.findall(r"(\d+ (?:passed|failed|skipped|error))", done.stdout.splitlines()[-1])
    return ", ".join(counted) or "none could be asked"
