"""Boards for the tests: the firmware on the host, and the ATmega2560's under simavr."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from benchmarks.boards import Board, build, no_pico
from benchmarks.boards import pico as emulated

Start = Callable[..., Board]


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], Path]:
    """Folder with what was built of a target, or a skip with the reason."""
    folder = tmp_path_factory.mktemp("firmware")
    reasons: dict[str, str] = {}

    def make(target: str, needs: str) -> Path:
        if target not in reasons:
            reasons[target] = build(target, folder, needs)
        if reasons[target]:
            pytest.skip(reasons[target])
        return folder

    return make


@pytest.fixture
def host(built: Callable[[str, str], Path]) -> Iterator[Start]:
    """Starts the firmware as a process, in lockstep unless told otherwise."""
    folder, boards = built("host", "cc"), []

    def start(*arguments: str, lockstep: bool = True) -> Board:
        boards.append(Board(folder / "rig-host", *(["lockstep"] if lockstep else []), *arguments))
        return boards[-1]

    yield start
    for board in boards:
        board.close()


@pytest.fixture
def avr(built: Callable[[str, str], Path]) -> Iterator[Start]:
    """Starts the ATmega2560's firmware under simavr with a plant."""
    folder, boards = built("avr", "avr-gcc"), []
    built("simrig", "cc simavr")

    def start(*arguments: str, drive: str = "analog") -> Board:
        image = folder / f"atmega2560-{drive}.elf"
        boards.append(Board(folder / "simrig", image, *([] if drive == "analog" else [drive]), *arguments))
        return boards[-1]

    yield start
    for board in boards:
        board.close()


@pytest.fixture
def pico(built: Callable[[str, str], Path]) -> Iterator[Start]:
    """Starts the Pico's image on rp2040js."""
    if reason := no_pico():
        pytest.skip(reason)
    folder, boards = built("pico", "arm-none-eabi-gcc"), []

    def start(drive: str = "pair") -> Board:
        boards.append(emulated(folder, drive))
        return boards[-1]

    yield start
    for board in boards:
        board.close()
