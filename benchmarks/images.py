"""How large is the firmware on each board, how long its longest tick, and does it keep every rule of the protocol?

Of the Mega simavr counts the cycles of its 16 MHz; rp2040js counts a Pico's instructions without the waits of its
flash, which is no evidence of time.
"""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from benchmarks.boards import FIRMWARE, Board, PicoLine, build, no_pico, pico, plant, rig_on
from benchmarks.designs import GAIN, PARAMETERS, PERIOD, inverted
from benchmarks.measure import Line, Target
from benchmarks.minute import held
from upright.laws import state_feedback
from upright.rigs import Limits, Mode

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


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """A row for each image with its longest tick, and of each rig that the rules are asked of; `quick`, no rules."""
    lines: list[Line] = []
    with tempfile.TemporaryDirectory(prefix="upright-firmware-") as name:
        folder = Path(name)
        if reason := build("avr", folder, "avr-gcc") or build("simrig", folder, "cc simavr"):
            lines.append(Line(contender="Mega", note=f"left out: {reason}"))
        else:
            lines += [
                _of_mega(folder, drive, quick, progress) for drive in ("analog", "pair", "sign")[: 1 if quick else None]
            ]
        if reason := build("pico", folder, "arm-none-eabi-gcc") or no_pico():
            lines.append(Line(contender="Pico", note=f"left out: {reason}"))
        else:
            lines += [_of_pico(folder, drive) for drive in ("pair", "sign")]
    for rig, (file, which) in ({} if quick else SUITES).items():
        progress(rig)
        lines.append(Line(contender=f"rules of the protocol, {rig}", note=_rules(file, which)))
    return lines


def _size(tool: str, image: Path) -> str:
    text, data, bss = subprocess.run([tool, image], capture_output=True, text=True, check=True).stdout.split()[6:9]
    return f"{(int(text) + int(data)) / 1e3:.1f} kB of flash, {(int(data) + int(bss)) / 1e3:.1f} kB of memory"


def _of_mega(folder: Path, drive: str, quick: bool, progress: Callable[[str], None]) -> Line:
    """Held through kicks by both loops, the wire and encoders busy."""

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
    return Line(
        contender=f"Mega, {drive}", seconds=(worst, worst, worst),
        target=Target(most=0.7 * _TICK / _CLOCK, of="seconds"),
        note=f"{_size('avr-size', folder / f'atmega2560-{drive}.elf')}; longest tick {longest[Mode.MCU]:.0f} "
        f"of {_TICK} cycles with the law on the board, {longest[Mode.HOST]:.0f} on the host",
    )  # fmt: skip


def _of_pico(folder: Path, drive: str) -> Line:

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
    return Line(
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
