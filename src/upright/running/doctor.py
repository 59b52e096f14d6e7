"""Is this rig wired as it is described? Checked before any loop: link, limits, and the first power-up with a person."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from upright.errors import BadInput, RigStopped
from upright.rig import Rig
from upright.rigs import Fault
from upright.rigs.rigfile import read_rig_file
from upright.running.power_up import PAUSE, CheckupFinding, FirstPowerUp, Hand
from upright.running.rig import model_and_truth, stage_of
from upright.units import is_acceleration

__all__ = ["Checkup", "CheckupFinding", "check_up"]


@dataclass(frozen=True, kw_only=True)
class Checkup:
    """What was found on a rig.

    Attributes
    ----------
    counts : mapping of str to float
        Signed counts per turn or metre that its encoders have, where those are not the described ones.
    written : Path or None
        RIG.toml, where they were written into it.
    dead_zone : tuple of (float, float)
        Largest command that did not move the driven body, and smallest that did [command unit]; zeros where no drive
        was tried.
    lost : tuple of (float, float)
        Command that the drive's dead zone takes to either side, and its standard error by the steps of the pulses
        [command unit]; zeros where none is seen beyond the model's dry friction.
    """

    name: str
    findings: tuple[CheckupFinding, ...]
    counts: Mapping[str, float] = field(default_factory=dict[str, float])
    written: Path | None = None
    dead_zone: tuple[float, float] = (0.0, 0.0)
    lost: tuple[float, float] = (0.0, 0.0)

    @property
    def sound(self) -> bool:
        """Whether a loop may be closed, as far as this can tell."""
        return all(f.good is not False for f in self.findings)

    @property
    def mends(self) -> tuple[str, ...]:
        """What is to be mended, in the order in which it was found."""
        return tuple(f.fix for f in self.findings if f.good is False and f.fix)

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
    path: Path, *, hand: Hand | None = None, clear: bool = False, pulse: bool = True,
    wait: Callable[[float], object] = PAUSE.wait,
) -> Checkup:  # fmt: skip
    """Look at the rig of a RIG.toml.

    Parameters
    ----------
    hand : callable, optional
        Called with a sentence that asks for something to be done, or with a question; answers whether it was done, or
        yes. A twin's own hand does it when omitted.
    clear : bool
        Whether latched faults are forgotten first.
    pulse : bool
        Whether the drive is tried.
    wait : callable
        Lets seconds pass in which nobody speaks to the rig.

    Raises
    ------
    BadInput
        When RIG.toml cannot be used.
    """
    file = read_rig_file(path)
    model, _ = model_and_truth(file)
    if pulse and is_acceleration(model.unit):  # of a twin too: it rehearses what the rig will be asked
        raise BadInput(
            f"the drive of {path} is commanded by its acceleration, so that the pulses of the doctor would leave it "
            "moving; look at the rest with --no-pulse."
        )
    stage = stage_of(path, balance=False)
    beside, rig, out = stage.supervisor, stage.supervisor.rig, list[CheckupFinding]()
    steps = FirstPowerUp(beside=beside, model=model, hand=hand, wait=wait)
    try:
        if clear:
            rig.open()
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
        out += steps.by_hand()
        if not pulse or about.replayed:
            out.append(CheckupFinding(what="the drive", observed="not tried", good=None))
        elif any(f.good is False for f in out):  # limits are in counts
            out.append(CheckupFinding(what="the drive", observed="not tried before that is mended", good=None))
        else:
            out += _of_drive(steps)
    except RigStopped as stop:
        what = "the drive" if beside.faults & Fault.SELF_TEST else "stopped"
        out.append(CheckupFinding(what=what, observed=str(stop), good=False))
    finally:
        rig.estop()
        rig.close()
    counts, written = dict(steps.counts), None
    lines = ", ".join(f"{name} = {value:.6g}" for name, value in counts.items())
    if counts and hand is not None and file.hardware and hand(
        f"Write the measured counts into {path}: {lines}? Answer no if you prefer to swap channels."
    ):  # fmt: skip
        written = file.with_counts(counts)
    (lost, error), unit = steps.lost, model.unit
    if lost and hand is not None and file.hardware and hand(
        f"Write the drive's dead zone into {path}: {lost:.3g} {unit} (standard error {error:.2g} {unit})? Laws then "
        "compensate for it."
    ):  # fmt: skip
        written = file.with_dead_zone(f"{lost:.3g} {unit}")
    return Checkup(
        name=model.name, findings=tuple(out), counts=counts, written=written, dead_zone=steps.dead_zone,
        lost=steps.lost,
    )  # fmt: skip


def _of_drive(steps: FirstPowerUp) -> Iterator[CheckupFinding]:
    """Whatever needs the drive; nothing more once something is wrong with it."""
    for step in (steps.drive, steps.button, steps.travel, steps.watchdog):
        wrong = False
        for finding in step():
            wrong |= finding.good is False
            yield finding
        if wrong:
            return


def _described(model: Rig, period: float, counts: tuple[float, ...]) -> list[CheckupFinding]:
    """Whether the rig is the one that was described."""
    same = math.isclose(period, model.period, rel_tol=1e-3)
    compared = f"{1e3 * period:.4g} ms, described as {1e3 * model.period:.4g} ms"
    alike = bool(np.allclose(np.abs(counts), model.per_unit, rtol=1e-6))
    return [
        CheckupFinding(what="servo period", observed=compared, good=same,
                       fix="" if same else "period in [board], or servo_period of the description"),
        CheckupFinding(what="counts", observed=", ".join(f"{c:.6g}" for c in counts), good=alike,
                       fix="" if alike else "[counts], or counts of the description"),
    ]  # fmt: skip
