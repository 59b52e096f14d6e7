"""Is this rig wired as it is described? Checked before any loop: link, limits, encoders by hand, a small pulse."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from upright.errors import RigStopped
from upright.rig import Rig
from upright.rigs import Board, Fault, LiveRig, TwinPort
from upright.rigs.board import fault_text
from upright.rigs.rigfile import read_rig_file
from upright.running.rig import model_and_truth, stage_of

MOVED = 0.05
"""How far a hand has to move a coordinate [rad, or 5 mm of a metre]."""


@dataclass(frozen=True, kw_only=True)
class CheckupFinding:
    """One thing that was looked at; `good` is None where it was not."""

    what: str
    observed: str
    good: bool | None = True


@dataclass(frozen=True, kw_only=True)
class Checkup:
    """What was found on a rig."""

    name: str
    findings: tuple[CheckupFinding, ...]

    @property
    def sound(self) -> bool:
        """Whether a loop may be closed, as far as this can tell."""
        return all(f.good is not False for f in self.findings)

    @property
    def verdict(self) -> str:
        """The first thing that is wrong, or that nothing is."""
        wrong = [f for f in self.findings if f.good is False]
        if wrong:
            return f"Do not close a loop: {wrong[0].what}: {wrong[0].observed}"
        left = [f.what for f in self.findings if f.good is None]
        rest = f" Not looked at: {', '.join(left)}." if left else ""
        return f"Link, limits and encoders of {self.name} answer as they should.{rest}"


def check_up(
    path: Path, *, hand: Callable[[str], bool] | None = None, clear: bool = False, pulse: bool = True
) -> Checkup:  # fmt: skip
    """Look at the rig of a RIG.toml.

    Parameters
    ----------
    hand : callable, optional
        Called with a sentence, to move a coordinate by hand in its positive sense; answers whether that was done.
        A twin's own hand does it when omitted.
    clear : bool
        Whether latched faults are forgotten first.
    pulse : bool
        Whether the self-test's pulse is given.

    Raises
    ------
    BadInput
        When RIG.toml cannot be used.
    """
    file = read_rig_file(path)
    model, _ = model_and_truth(file)
    stage = stage_of(path, balance=False)
    beside, rig, out = stage.supervisor, stage.supervisor.rig, list[CheckupFinding]()
    try:
        if clear:
            about = rig.open()
            rig.clear_fault()
            rig.close()
        about = beside.prepare()
        ticks = f"{about.name}, {len(about.counts)} encoders, a tick every {1e3 * about.period:.4g} ms"
        out.append(CheckupFinding(what="link", observed=ticks))
        out += _described(model, about.period, about.counts)
        held = ", ".join(f"{n} {v:.4g}" for n, v in zip(about.coordinates, beside.held.travel, strict=True))
        volts, silence = f"{beside.held.command:.4g} {about.command_unit}", f"{1e3 * beside.held.watchdog:.4g} ms"
        held = f"travel {held}; command {volts}; watchdog {silence}"
        out.append(CheckupFinding(what="limits, read back", observed=held))
        for i, name in enumerate(about.coordinates):
            out.append(_by_hand(rig, model, i, name, hand))
        if not pulse or about.replayed:
            out.append(CheckupFinding(what="a small pulse", observed="not given", good=None))
        else:
            if isinstance(rig, Board) and isinstance(rig.port, TwinPort):
                rig.port.hold(beside.duty.zero)
                rig.port.let_go()
            moved = beside.check().moved
            shown = ", ".join(f"{n} {v:.4g}" for n, v in moved.items())
            out.append(CheckupFinding(what="a small pulse", observed=shown))
    except RigStopped as stop:
        what = "a small pulse" if beside.faults & Fault.SELF_TEST else "stopped"
        out.append(CheckupFinding(what=what, observed=str(stop), good=False))
    finally:
        rig.estop()
        rig.close()
    return Checkup(name=model.name, findings=tuple(out))


def _described(model: Rig, period: float, counts: tuple[float, ...]) -> list[CheckupFinding]:
    """Whether the rig is the one that was described."""
    same = math.isclose(period, model.period, rel_tol=1e-3)
    compared = f"{1e3 * period:.4g} ms, described as {1e3 * model.period:.4g} ms"
    out = [CheckupFinding(what="servo period", observed=compared, good=same)]
    alike = np.allclose(np.abs(counts), model.per_unit, rtol=1e-6)
    return [*out, CheckupFinding(what="counts", observed=", ".join(f"{c:.6g}" for c in counts), good=bool(alike))]


def _by_hand(
    rig: LiveRig, model: Rig, i: int, name: str, hand: Callable[[str], bool] | None
) -> CheckupFinding:  # fmt: skip
    """One encoder, moved by hand in its positive sense."""
    unit, per = model.plant.coordinates[i].unit, model.per_unit[i]
    size = MOVED if unit == "rad" else MOVED / 10
    before = rig.exchange(0.0)
    if before.faults:
        return CheckupFinding(what=f"{name} by hand", observed=fault_text(before.faults), good=False)
    what = f"{name} by hand"
    if hand is not None:
        if not hand(f"Move {name} by hand in its positive sense by some {'degrees' if unit == 'rad' else 'mm'}."):
            return CheckupFinding(what=what, observed="not moved", good=None)
    elif isinstance(rig, Board) and isinstance(rig.port, TwinPort):
        away = np.zeros(2 * len(model.per_unit))
        away[2 * i] = 2 * size
        rig.port.hold(next(iter(model.plant.equilibria)), away)
    else:
        return CheckupFinding(what=what, observed="it was not moved", good=None)
    moved = (rig.exchange(0.0).counts[i] - before.counts[i]) / per
    shown = f"{math.degrees(moved):.3g} degrees" if unit == "rad" else f"{1e3 * moved:.3g} mm"
    if abs(moved) < size / 10:
        return CheckupFinding(what=what, observed=f"showed {shown}: not connected, or not this channel", good=False)
    if moved < 0:
        return CheckupFinding(
            what=what, observed=f"showed {shown}: it counts the wrong way, swap its channels", good=False
        )
    return CheckupFinding(what=what, observed=f"showed {shown}")
