"""Images of the firmware: built from the C sources of this package, or as they come with it."""

from __future__ import annotations

import math
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from upright.errors import BadInput
from upright.files import replace_file
from upright.rigs.firmware.boards import BoardKind
from upright.rigs.protocol import Limits

_HERE = Path(__file__).parent
READY = _HERE / "images"
"""Images that were built with the package, where it has any."""
_WINDOW, _TICK = 8, 1e-3  # ticks over which the firmware measures a speed; s
_NO_LIMIT = 0x7FFFFFFF


def sources() -> Path:
    """Folder of the firmware's C sources: with the installed package, or in a checkout beside `src`."""
    installed = _HERE / "source"
    return installed if installed.is_dir() else _HERE.parents[3] / "firmware"


@dataclass(frozen=True, kw_only=True)
class Image:
    """What goes onto a board.

    Attributes
    ----------
    ready : bool
        Whether it came with the package, instead of being built here.
    ceilings : mapping of str to int
        What its limits can never be widened beyond, where they are a rig's own: by name of `ceilings.h`.
    """

    path: Path
    ready: bool
    ceilings: Mapping[str, int] = field(default_factory=dict[str, int])


def ceilings_of(limits: Limits, counts: tuple[float, ...], full_scale: float) -> dict[str, int]:
    """A rig's limits as the firmware compiles them in: counts, counts in 8 ticks, percent, ticks of 1 ms.

    Parameters
    ----------
    counts : tuple of float
        Per rad or m of each encoder.
    full_scale : float
        Command at full output [command unit].
    """
    out = {"COMMAND": min(100, math.ceil(100 * limits.command / full_scale - 1e-9))}
    for i, (travel, speed, per) in enumerate(zip(limits.travel, limits.speed, counts, strict=True), start=1):
        out[f"TRAVEL_{i}"] = _NO_LIMIT if math.isinf(travel) else math.ceil(travel * abs(per))
        if math.isfinite(speed):
            out[f"SPEED_{i}"] = math.ceil(speed * abs(per) * _WINDOW * _TICK)
    if math.isfinite(limits.saturation):
        out["SATURATION"] = math.ceil(limits.saturation / _TICK)
    return out


def ceilings_in_words(ceilings: Mapping[str, int]) -> tuple[tuple[str, str], ...]:
    """Ceilings as a person reads them, each with its unit."""

    def shown(name: str, value: int) -> str:
        if name == "COMMAND":
            return f"{value} % of full output"
        if name.startswith(("TRAVEL", "SPEED")):
            within = "" if name.startswith("TRAVEL") else f" in {1e3 * _WINDOW * _TICK:g} ms"
            return "none" if value == _NO_LIMIT else f"{value:,} counts{within}"
        return f"{1e3 * _TICK * value:g} ms"

    words = {"SATURATION": "time at the largest command", "BRAKE": "brake after a stop"}
    rows = ((words.get(n) or n.lower().replace("_", " of encoder "), shown(n, v)) for n, v in ceilings.items())
    return tuple(rows)


def build_image(board: BoardKind, drive: str, out: Path, ceilings: Mapping[str, int] | None = None) -> Image:
    """The image of a board in a folder; the one that came with the package where it is as good and nothing can build.

    Raises
    ------
    BadInput
        When a tool is missing, with what brings it, or the compiler refuses.
    """
    name = board.image(drive)
    target = out / name
    missing = {tool: package for tool, package in board.tools.items() if shutil.which(tool) is None}
    if missing:
        if not ceilings and (READY / name).is_file():
            return Image(path=replace_file(target, (READY / name).read_bytes()), ready=True)
        why = " with your ceilings" if ceilings else ""
        raise BadInput(
            f"to build the image{why}, {' and '.join(missing)} must be on this machine "
            f"(sudo apt install {' '.join(missing.values())}); this package has no ready one{why}."
        )
    flags = " ".join(f"-DCEILING_{k}={v}" for k, v in (ceilings or {}).items())
    with tempfile.TemporaryDirectory(prefix="upright-firmware-") as folder:
        built = subprocess.run(
            ["make", "-s", "-C", str(sources()), f"B={folder}", f"CEILINGS={flags}", f"{folder}/{name}"],
            capture_output=True, encoding="utf-8", errors="replace", check=False,
        )  # fmt: skip
        if built.returncode:
            raise BadInput(f"the firmware does not compile: {built.stderr.strip()[-500:]}")
        return Image(
            path=replace_file(target, (Path(folder) / name).read_bytes()), ready=False, ceilings=dict(ceilings or {})
        )
