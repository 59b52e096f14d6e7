"""The firmware of a board of one's own: built, flashed, its wires."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from upright.errors import BadInput
from upright.files import keeps_its_inputs, replace_file
from upright.verbs.answer import Answer
from upright.verbs.command import command

if TYPE_CHECKING:
    from upright.files import PathLike
    from upright.rigs.firmware import Flashed, Image, Pin

_METAVARS = {"board": "NAME", "drive": "NAME", "rig": "RIG.toml", "port": "PORT", "brake": "TIME"}


@command(
    name="firmware build",
    metavars=_METAVARS,
    defaults={"out": "upright-firmware"},
    more="""
    upright firmware build --drive pair
    upright firmware build --drive pair --rig RIG.toml     ceilings that no host can widen: the rig's own limits
    upright firmware build --drive pair --brake 0.3s       a stop shorts the motor for so long (BTS7960)
    """,
)
@keeps_its_inputs
def firmware_build(
    *, board: str = "mega", drive: str = "analog", rig: PathLike | None = None,
    brake: float | str | None = None, out: PathLike | None = None,
) -> Answer[Image]:  # fmt: skip
    """Make the image that goes onto a board.

    Where no compiler is, the image that comes with the package is taken, if it has one.

    Parameters
    ----------
    board : str
        ``"mega"``, an Arduino Mega 2560, or ``"pico"``, a Raspberry Pi Pico.
    drive : str
        ``"analog"``: a converter into a servo amplifier; ``"pair"``: an H-bridge with a PWM line for each way
        (BTS7960, DRV8871); ``"sign"``: one PWM line and the way (VNH5019, L298N).
    rig : path, optional
        RIG.toml whose [limits] are compiled in as ceilings.
    brake : float or str, optional
        For how long a stop leaves the bridge on with both lines low, so that it shorts the motor, ``"0.3 s"``; 1 s at
        most. For a BTS7960 (``"pair"``); without it the rig coasts.
    out : path
        Folder for the image; a command's is upright-firmware when omitted.

    Returns
    -------
    Answer
        Of an `Image`: its `path`, whether it came `ready`, its `ceilings`.

    Raises
    ------
    BadInput
        When there is no such board, or a tool is missing.
    """
    from upright.report.page import Chapter, Facts, Part
    from upright.rigs.firmware import board_of, build_image, ceilings_in_words

    if out is None:
        raise BadInput("an image is a file: name a folder for it, such as out='firmware'.")
    made = board_of(board)
    image = build_image(made, drive, Path(out), _ceilings(rig, brake, drive))
    whence = "It comes with this package." if image.ready else "It was built on this machine."
    held = ceilings_in_words(image.ceilings)
    return Answer(
        image,
        Chapter(
            title=f"Firmware for the {made.title}", verdict=f"{image.path.name} is ready to be flashed.", detail=whence,
            parts=(Part("Compiled in: no host can widen it", (Facts(held),)),) if held else (),
            numbers={"image": str(image.path), "ready": image.ready, "ceilings": dict(image.ceilings)},
        ),
        [image.path],
    )  # fmt: skip


@command(
    name="firmware flash",
    metavars=_METAVARS,
    defaults={"out": "upright-firmware"},
    more="""
    With the motor's supply off.

    upright firmware flash --drive pair --rig RIG.toml
    """,
)
def firmware_flash(
    *, board: str = "mega", drive: str = "analog", rig: PathLike | None = None,
    brake: float | str | None = None, port: str | None = None, out: PathLike | None = None,
    hand: Callable[[str], bool] = lambda _: True,
) -> Answer[Flashed]:  # fmt: skip
    """Build the image, write it to a board once you agree, and verify it.

    Without a board it ends within seconds.

    Parameters
    ----------
    board, drive : str
        As of `firmware_build`.
    rig : path, optional
        RIG.toml whose [limits] are compiled in as ceilings.
    brake : float or str, optional
        As of `firmware_build`.
    port : str, optional
        Where the board is; found where it is left out.
    out : path
        Folder for the image; a command's is upright-firmware when omitted.
    hand : callable, optional
        Asked before anything is written.

    Returns
    -------
    Answer
        Of a `Flashed`: `port`, `image`, the firmware's `greeting`.

    Raises
    ------
    BadInput
        When no board is found, or a tool is missing.
    RigStopped
        When the board does not answer, or does not hold what was written.
    """
    from upright.report.page import Chapter
    from upright.rigs.firmware import board_of, build_image, flash

    if out is None:
        raise BadInput("an image is a file: name a folder for it, such as out='firmware'.")
    made = board_of(board)
    image = build_image(made, drive, Path(out), _ceilings(rig, brake, drive))
    flashed = flash(made, image.path, port or "", hand=hand)
    return Answer(
        flashed,
        Chapter(
            title=f"Firmware on the {made.title}",
            verdict=f"{flashed.greeting} answers." if flashed.greeting else f"{image.path.name} was copied.",
            detail=("The image was read back and compared." if made.flasher else "The boot ROM checks each block.")
            + (" The board" if flashed.greeting else " Name --port to have the board asked, too; it")
            + " stands in FAULT until a host clears it.",
            numbers={"port": flashed.port, "image": str(flashed.image), "greeting": flashed.greeting},
        ),
        [image.path],
    )  # fmt: skip


@command(name="firmware pins", metavars={**_METAVARS, "out": "DRAWING.svg"})
def firmware_pins(
    *, board: str = "mega", drive: str = "analog", out: PathLike | None = None
) -> Answer[tuple[Pin, ...]]:
    """List which wire goes to which pin, from the table that the firmware is compiled with.

    Parameters
    ----------
    board, drive : str
        As of `firmware_build`.
    out : path, optional
        File for a drawing of it (SVG).

    Returns
    -------
    Answer
        Of a tuple of `Pin`: `number`, `name`, `signal`, `device`, `terminal`.

    Raises
    ------
    BadInput
        When there is no such board or drive.
    """
    from upright.report.page import Chapter, Part, Table
    from upright.rigs.firmware import board_of, pins, wiring
    from upright.rigs.firmware.boards import DRIVES

    made = board_of(board)
    wires = pins(made, drive)
    rows = tuple((str(pin.number), pin.name, pin.device, pin.terminal) for pin in wires)
    table = Table(caption="", headings=("pin", "", "goes to", ""), rows=rows)
    files = [] if out is None else [replace_file(Path(out), wiring(made, drive, wires).encode())]
    return Answer(
        wires,
        Chapter(
            title=f"Wires of the {made.title}", verdict=f"For {DRIVES[drive]}.",
            detail="Grounds of board, encoders and power stage are joined at one point.",
            parts=(Part("Wires", (table,)),), numbers={pin.signal: pin.number for pin in wires},
        ),
        files,
    )  # fmt: skip


def _ceilings(rig: PathLike | None, brake: float | str | None, drive: str) -> dict[str, int]:
    """A rig's own limits, and for how long it brakes [ticks], as its board can be compiled for them."""
    from upright.rigs.firmware.boards import PAIR
    from upright.verbs.values import si_if_given

    ticks = round(1e3 * (si_if_given(brake, "s") or 0.0))
    if not 0 <= ticks <= 1000:
        raise BadInput(f"--brake must be from 0 to 1 s, got {ticks / 1e3:g} s.")
    if ticks and drive != PAIR:
        raise BadInput(
            f"--brake needs a bridge that shorts the motor while both PWM lines are low (BTS7960): --drive {PAIR}, got "
            f"'{drive}'; with any other drive the board can only switch off."
        )
    return {**({} if rig is None else _limits(Path(rig))), **({"BRAKE": ticks} if ticks else {})}


def _limits(path: Path) -> dict[str, int]:
    from upright.rigs.driver import FULL_SCALE
    from upright.rigs.firmware import ceilings_of
    from upright.rigs.rigfile import read_rig_file
    from upright.running.rig import model_and_truth

    file = read_rig_file(path)
    rig, _ = model_and_truth(file)
    limits = file.limits({c.name: c.unit for c in rig.plant.coordinates}, rig.unit)
    if limits is None:
        raise BadInput(f"{path} has no [limits], and the board's ceilings follow from them; fill them in.")
    return ceilings_of(limits, rig.per_unit, float(file.board.get("full_scale", FULL_SCALE)))
