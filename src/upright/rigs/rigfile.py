"""RIG.toml: what a rig is, how it is reached, where its description is, and how far it may go.

A twin of a fit::

    kind = "twin"
    fit = "out/fit.json"

A rig of one's own behind a wire, whose limits nobody may leave out::

    kind = "serial"
    port = "/dev/ttyACM0"
    fit = "out/fit.json"

    [limits]
    command = "5 V"
    watchdog = "20 ms"
    lean = "25 deg"

    [limits.psi]
    travel = "1.5 rad"
    speed = "20 rad/s"
    start = "0.3 rad"

Where its encoders count otherwise than it is described, per turn or metre, with a minus for the other way round::

    [counts]
    psi = -2400

And what its drive swallows of a command to either side (`upright rig doctor` writes both)::

    [drive]
    dead_zone = "0.4 V"
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from upright.files import replace_file
from upright.rigs.driver import DRIVERS
from upright.rigs.protocol import Limits
from upright.study.text import Section, StudyText, toml

KEYS = (
    "kind", "name", "fit", "study", "make", "seed", "vendor", "port", "record", "at", "zero", "limits", "board",
    "loadings", "counts", "drive",
)  # fmt: skip
_EACH = ("travel", "speed", "start")
_ALL = ("command", "watchdog", "saturation", "frozen", "twist", "lean")


@dataclass(frozen=True, kw_only=True)
class RigFile:
    """What a RIG.toml says.

    Attributes
    ----------
    path : Path
        The file itself.
    kind : str
        One of `driver.DRIVERS`.
    name : str, optional
        As its owner calls it.
    known : Path or None
        fit.json or study that describes it.
    performed : str
        That no rig is driven, where that is so.
    make : str, optional
        Key of the make whose twin it is, with `seed`; beside a description, which is then what is known of it.
    vendor : str, optional
        Whose data sheet says the rest.
    port : str, optional
        Of a serial rig.
    record : Path or None
        That a replay plays.
    at, zero : str
        Equilibrium that is held, and the one at which the encoders are zeroed.
    board : mapping of str to any
        What a vendor's port takes by name.
    added, tolerance : tuple of str, float
        Known inertias that experiment 1a bolts to the rig one after the other, as their owner says them, and the
        relative standard uncertainty of a piece.
    counts : mapping of str to float
        Signed counts per turn or metre of coordinates whose encoders count otherwise than described.
    """

    path: Path
    kind: str
    name: str | None = None
    known: Path | None = None
    make: str | None = None
    performed: str = ""
    seed: int = 0
    vendor: str | None = None
    port: str | None = None
    record: Path | None = None
    at: str = "inverted"
    zero: str = "hanging"
    board: Mapping[str, Any] = field(default_factory=dict[str, Any])
    added: tuple[str, ...] = ()
    tolerance: float = 0.0
    counts: Mapping[str, float] = field(default_factory=dict[str, float])

    @property
    def hardware(self) -> bool:
        """Whether something can really move."""
        return not self.performed

    def limits(self, units: Mapping[str, str], command_unit: str, default: Limits | None = None) -> Limits | None:
        """How far the rig may go; the default where the file says nothing, None where hardware has no limits.

        Parameters
        ----------
        units : mapping of str to str
            ``"rad"`` or ``"m"`` by coordinate, in the plant's order.
        default : Limits, optional
            For what the file leaves out; of hardware nothing is ever filled in.

        Raises
        ------
        BadInput
            When limits of hardware leave out what is required.
        """
        section = _root(self.path).section("limits")
        if not section.values:
            return None if self.hardware else default
        section.check((*_ALL, *units), "limit or coordinate")
        base = None if self.hardware else default
        if "command" not in section and base is None:
            raise section.error("command", f'[limits] needs the largest command, such as command = "5 {command_unit}"')
        rows: dict[str, list[float]] = {name: [] for name in _EACH}
        for i, (name, unit) in enumerate(units.items()):
            own = section.section(name)
            own.check(_EACH, "limit")
            for kind in _EACH:
                if kind not in own and base is None and i == 0:
                    raise section.error(
                        name,
                        f"[limits.{name}] needs {kind}, since {name} is what the drive moves; write "
                        f'{kind} = "... {_unit(kind, unit)}"',
                    )
                usual = math.inf if base is None else getattr(base, kind)[i]
                rows[kind].append(own.positive(kind, _unit(kind, unit), usual))
        first = next(iter(units.values()))
        usual = base or Limits(travel=(1.0,), speed=(1.0,), start=(1.0,), command=1.0)
        with section.at("command"):
            return Limits(
                travel=tuple(rows["travel"]), speed=tuple(rows["speed"]), start=tuple(rows["start"]),
                command=section.positive("command", command_unit, usual.command),
                watchdog=section.positive("watchdog", "s", usual.watchdog),
                saturation=section.positive("saturation", "s", usual.saturation),
                frozen=section.number("frozen", first, usual.frozen),
                twist=section.positive("twist", first, usual.twist),
            )  # fmt: skip

    def command(self, unit: str) -> float | None:
        """Largest command that the file allows [its unit]; None where it says none."""
        section = _root(self.path).section("limits")
        return section.positive("command", unit, 1.0) if "command" in section else None

    def with_fit(self, fit: Path, path: Path) -> Path:
        """Write the same file with a fit for its description."""
        values = {k: v for k, v in _root(self.path).values.items() if k not in ("fit", "study", "record")}
        values["fit"] = Path(os.path.relpath(fit, path.parent)).as_posix()
        return replace_file(path, "".join(f"{k} = {toml(v, 17)}\n" for k, v in values.items()).encode())

    def dead_zone(self, unit: str, default: float) -> float:
        """Command that the drive swallows to either side [its unit]."""
        drive = _root(self.path).section("drive")
        drive.check(("dead_zone",), "number of the drive")
        return drive.number("dead_zone", unit, default)

    def with_counts(self, counts: Mapping[str, float]) -> Path:
        """Write signed counts per turn or metre into the file; everything else stays as its owner wrote it."""
        return self._with("counts", {**self.counts, **counts})

    def with_dead_zone(self, dead_zone: str) -> Path:
        """Write what the drive swallows, such as ``"0.4 V"``, into the file."""
        return self._with("drive", {"dead_zone": dead_zone})

    def _with(self, section: str, values: Mapping[str, Any]) -> Path:
        lines = [f"{name} = {toml(value, 9)}" for name, value in values.items()]
        text = self.path.read_text(encoding="utf-8").rstrip("\n")
        before, there, after = text.partition(f"\n[{section}]")
        rest = "".join(f"\n[{part}" for part in after.split("\n[")[1:])
        before = before if there else text + "\n"
        return replace_file(
            self.path, ("\n".join([before, f"[{section}]", *lines]) + f"\n{rest}".rstrip() + "\n").encode()
        )

    def lean(self, unit: str, default: float) -> float:
        """How far the last coordinate may be from what is held [rad or m]."""
        return _root(self.path).section("limits").positive("lean", unit, default)


def _unit(kind: str, unit: str) -> str:
    return f"{unit}/s" if kind == "speed" else unit


def _root(path: Path) -> Section:
    return StudyText(path).root()


def read_rig_file(path: Path) -> RigFile:
    """Content of a RIG.toml.

    Raises
    ------
    BadInput
        When it is none, or contradicts itself; with file and line.
    """
    root = _root(path)
    root.check(KEYS)
    if "kind" not in root:
        raise root.error("kind", f'a rig needs kind, one of {", ".join(DRIVERS)}, such as kind = "twin"')
    kind = root.choice("kind", tuple(DRIVERS), "twin")
    with root.at("kind"):
        driver = DRIVERS[kind]
    texts = {k: root.text_of(k, e) for k, e in _EXAMPLES.items() if k in root}
    if "fit" in texts and "study" in texts:
        raise root.error("study", "a rig is described by a fit or by a study; leave one out")
    known = texts.get("fit") or texts.get("study")
    place = path.parent
    if known is not None and not (place / known).exists():
        raise root.error("fit" if "fit" in texts else "study", f"{place / known} does not exist")
    if known is None and not ("make" in texts and driver.performed):
        other = ' or make = "furuta"' if driver.performed else ""
        raise root.error("kind", f'a rig needs what describes it: fit = "out/fit.json" or study = "study.toml"{other}')
    for key in ("port", "record"):
        if key in driver.needs and key not in texts:
            raise root.error("kind", f'kind = "{kind}" needs {key} = "{driver.needs[key]}"')
        if key not in driver.needs and key in texts:
            raise root.error(key, f'kind = "{kind}" has no {key}; leave it out')
    seed = root.values.get("seed", 0)
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise root.error("seed", f"seed is a whole number from 0 on, got {seed!r}")
    board, loadings, counts = root.section("board").values, root.section("loadings"), root.section("counts")
    if driver.performed and counts.values:
        raise root.error("counts", f'kind = "{kind}" counts as it is described; leave [counts] out')
    if driver.performed and root.section("drive").values:
        raise root.error("drive", f'kind = "{kind}" has the drive that is described; leave [drive] out')
    for name in counts.values:
        if not counts.number(name, "1", 1.0):
            raise counts.error(name, "counts per turn or metre are not zero; a minus turns the encoder round")
    loadings.check(("added", "tolerance"))
    tolerance = loadings.number("tolerance", "1", 0.0)
    if not 0 <= tolerance < 1:
        raise loadings.error("tolerance", 'tolerance is a share of a piece from 0 to below 1, such as "0.2 %"')
    return RigFile(
        path=path, kind=kind, performed=driver.performed, name=texts.get("name"),
        known=None if known is None else place / known,
        make=texts.get("make"), seed=seed, vendor=texts.get("vendor"), port=texts.get("port"),
        record=place / texts["record"] if "record" in texts else None, at=texts.get("at", "inverted"),
        zero=texts.get("zero", "hanging"), board=board, tolerance=tolerance,
        added=tuple(str(a) for a in loadings.entries("added")),
        counts={name: counts.number(name, "1", 1.0) for name in counts.values},
    )  # fmt: skip


_EXAMPLES = {
    "name": "bench 3", "fit": "out/fit.json", "study": "study.toml", "make": "furuta", "vendor": "ECP 205",
    "port": "/dev/ttyACM0", "record": "run.csv", "at": "inverted", "zero": "hanging",
}  # fmt: skip
