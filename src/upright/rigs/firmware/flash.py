"""An image onto a board: the port found, the person asked, what was written read back, the firmware greeted."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from upright.errors import BadInput, RigStopped
from upright.rigs.firmware.boards import BoardKind
from upright.rigs.line import ports
from upright.rigs.serial import SerialRig

_LOOKS, _WRITES = 10.0, 90.0  # s, after which a flasher is ended that finds no board, or does not come to its end
Run = Callable[[Sequence[str], float], "subprocess.CompletedProcess[str]"]


@dataclass(frozen=True, kw_only=True)
class Flashed:
    """What happened.

    Attributes
    ----------
    greeting : str
        What the firmware answered afterwards; empty where it was not asked, as on a Pico without a port.
    """

    port: str
    image: Path
    greeting: str


def port_of(board: BoardKind, port: str, there: dict[str, int]) -> str:
    """The port that is meant, or the only one a board of this kind is at.

    Raises
    ------
    BadInput
        When there is none, or more than one.
    """
    if port:
        return port
    fitting = [name for name, vendor in there.items() if vendor in board.usb]
    if len(fitting) == 1:
        return fitting[0]
    if not fitting:
        others = f" (there are {', '.join(there)}, of other makers)" if there else ""
        raise BadInput(f"no {board.title} is plugged in{others}; check its cable, or name its port with --port.")
    raise BadInput(f"several boards are plugged in, at {', '.join(fitting)}; say which with --port.")


def in_time(command: Sequence[str], seconds: float) -> subprocess.CompletedProcess[str]:
    """A program's end, or that of our patience."""
    try:
        return subprocess.run(
            command, capture_output=True, encoding="utf-8", errors="replace", timeout=seconds, check=False
        )
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(command, 1, "", f"it did not end within {seconds:g} s")


def greeted(port: str) -> str:
    """What the firmware at a port calls itself."""
    rig = SerialRig(port, coordinates=("1", "2"), counts=(1.0, 1.0), command_unit="", full_scale=1.0)
    try:
        return rig.open().name
    finally:
        rig.close()


def flash(
    board: BoardKind, image: Path, port: str = "", *, hand: Callable[[str], bool] = lambda _: True, run: Run = in_time,
    greet: Callable[[str], str] = greeted, there: Callable[[], dict[str, int]] = ports,
) -> Flashed:  # fmt: skip
    """Write an image onto a board, and greet what is on it then.

    Parameters
    ----------
    port : str
        Where it is; found where it is empty.
    hand : callable
        Asked before anything is written.
    run, greet, there : callable
        A program for so many seconds; the firmware at a port; ports with their USB vendors.

    Raises
    ------
    BadInput
        When no board is found, or the flasher is not here.
    RigStopped
        When the person says no, the board does not answer within seconds, or what is on it is not what was written.
    """
    if not board.flasher:
        return _copied(board, image, port, hand, greet)
    if shutil.which(board.flasher) is None:
        raise BadInput(
            f"to write the image, {board.flasher} is needed on this machine (sudo apt install {board.flasher})."
        )
    at = port_of(board, port, there() if not port else {})
    common = [board.flasher, "-p", board.name, "-c", "wiring", "-P", at, "-b", "115200", "-D"]
    looked = run([*common, "-n"], _LOOKS)
    if looked.returncode:
        raise RigStopped(f"No {board.title} answers at {at}: {_last(looked.stderr)} Check cable and port.")
    if not hand(_question(board, at, image)):
        raise RigStopped("Nothing was written.")
    written = run([*common, "-U", f"flash:w:{image}:i"], _WRITES)  # reads it back by itself
    if written.returncode:
        raise RigStopped(f"The image was not written completely: {_last(written.stderr)} Flash again.")
    return Flashed(port=at, image=image, greeting=greet(at))


def drives() -> list[Path]:
    """Where drives of a board that waits for its image are mounted: `INFO_UF2.TXT` says what they are."""
    home = Path.home().name
    places = [
        Path("/media") / home,
        Path("/run/media") / home,
        Path("/Volumes"),
        *map(Path, ("D:/", "E:/", "F:/", "G:/")),
    ]
    return [folder for place in places for folder in (place, *_inside(place)) if (folder / "INFO_UF2.TXT").is_file()]


def _inside(place: Path) -> list[Path]:
    try:
        return [*place.iterdir()] if place.is_dir() else []
    except OSError:
        return []


def _copied(
    board: BoardKind, image: Path, port: str, hand: Callable[[str], bool], greet: Callable[[str], str]
) -> Flashed:
    """An image onto the drive that a board shows while its button is held; the boot ROM checks each block."""
    volumes = drives()
    if len(volumes) != 1:
        raise BadInput(
            f"a {board.title} takes its image as a USB drive: hold BOOTSEL while you plug it in, and run this again. "
            f"Such drives here: {len(volumes) or 'none'}. Or copy {image} onto it yourself."
        )
    if not hand(_question(board, str(volumes[0]), image)):
        raise RigStopped("Nothing was written.")
    shutil.copyfile(image, volumes[0] / image.name)
    return Flashed(port=port or str(volumes[0]), image=image, greeting=greet(port) if port else "")


def _question(board: BoardKind, at: str, image: Path) -> str:
    return f"Write {image.name} to the {board.title} at {at}? What is on it is lost; the motor's supply must be off."


def _last(text: str) -> str:
    """The flasher's last word, as a sentence."""
    lines = [line.strip() for line in text.splitlines() if line.strip() and "done" not in line]
    return (lines[-1].rstrip(".") if lines else "it printed nothing") + "."
