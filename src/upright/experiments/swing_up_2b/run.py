"""Experiment 2b, from hanging to upright: encoders first, then pump, catch and hold; and what faulty encoders do.

The law is designed from what is known of the rig, a fit or the make's data sheet; it runs on the rig itself, here the
twin's truth.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from upright.basis import SIMULATED
from upright.control import SwingUp, design_swing_up, trial
from upright.control.effort import RestEffort, rest_effort
from upright.control.score import FALLEN
from upright.control.sensors import KNOWN, Scales, probe, scales, shown_by_encoders
from upright.control.swing_up import Ascent, ascent_of
from upright.control.trial import readings
from upright.control.watch import Suspicion, Watch
from upright.errors import BadInput, NotIdentifiable, RigStopped, nearest
from upright.experiments.stand.stand import APPLIED, TestStand
from upright.gains import feedback, filtered
from upright.progress import Progress, silent
from upright.records import Array, Record
from upright.rig import Rig
from upright.units import same_dimension, scale

HELD = 5.0
"""How long the pendulum must stand before it counts as caught [s]."""
SECONDS = 12.0
TILT = math.radians(3)
"""From which a loop with a faulty encoder is switched on [rad]."""
LEAST = math.radians(40)
"""Swing below which the period tells too little of the amplitude [rad]: at 40 degrees it is 3 % longer."""
FAULTS = (("theta", -1.0), ("theta", 0.25), ("theta", 0.5), ("theta", 2.0), ("theta", 1.1), ("", -1.0), ("", 4.0))
"""Encoders tried: a coordinate, the driven one where it is empty, and what it shows over what is true."""


@dataclass(frozen=True, kw_only=True)
class FaultyEncoder:
    """What becomes of one faulty encoder.

    Attributes
    ----------
    name : str
        Coordinate.
    factor : float
        What it shows over what is true.
    estimate, error : float
        The same as measured hanging, with its standard error.
    refused : bool
        Whether the hanging rig gave it away.
    spoke : float
        When the watch of a running loop would have switched off [s]; inf when it would not.
    tilt : float
        True deviation from upright then [rad]; 0 when it would not.
    suspicion : str
        What the watch took it for.
    fell : float
        When the loop fell without a watch [s]; inf when it stood.
    """

    name: str
    factor: float
    estimate: float
    error: float
    refused: bool
    spoke: float
    tilt: float
    suspicion: str
    fell: float


@dataclass(frozen=True, kw_only=True, eq=False)
class SwingUpRun:
    """What the experiment found.

    Attributes
    ----------
    model : Rig
        As known.
    log : Record
        Of the encoders under commands put out blindly.
    check : Scales
        What that says of the encoders.
    ascent : Ascent or None
        None when an encoder is faulty: then no loop is closed.
    faulty : tuple of FaultyEncoder
    source : str
        File that the model comes from, as typed; empty for the data sheet.
    seconds : float
        Computing time.
    performed : str
        `basis.SIMULATED` where no rig was driven.
    """

    model: Rig
    truth: Rig
    log: Record
    check: Scales
    law: SwingUp
    ascent: Ascent | None
    faulty: tuple[FaultyEncoder, ...]
    source: str
    folder: Path
    seconds: float = 0.0
    performed: str = SIMULATED

    @property
    def caught(self) -> bool:
        """Whether it stood for `HELD` at the end, the drive on."""
        a = self.ascent
        return a is not None and math.isinf(a.tripped) and a.up <= float(a.trial.t[-1]) - HELD

    @property
    def rest(self) -> RestEffort | None:
        """What holding takes once it stands; None where it does not."""
        if self.ascent is None or not self.caught:
            return None
        run = self.ascent.trial
        stands = run.t >= self.ascent.up
        return rest_effort(run.t[stands], run.u[stands], self.law.limit)

    @property
    def sound(self) -> bool:
        """Whether it was caught and stands by a quiet command, whatever its model is worth."""
        return self.rest is not None and self.rest.quiet


def known_of(identified: Rig) -> Mapping[str, float]:
    """Relative standard errors of a fit's numbers, from the rigs that it allows; friction as it may be on the day."""
    out: dict[str, float] = {}
    for name, value in identified.plant.parameters().items():
        drawn = np.array([plant.parameters()[name] for plant, _ in identified.draws])
        if value and drawn.size and np.ptp(drawn) > 0:
            spread = max(float(np.std(drawn)) / abs(value), KNOWN["b"] if name.startswith("b") else 2e-3)
            out[name] = min(spread, 1.0)  # a friction that the fit puts at its bound is not known at all
    gains = np.array([gain for _, gain in identified.draws])
    if gains.size and np.ptp(gains) > 0:
        out["gain"] = max(float(np.std(gains)) / abs(identified.gain), 2e-3)
    return out


def scales_of_log(model: Rig, log: Record, known: Mapping[str, float] | None = None) -> Scales:
    """Scales of the encoders from a log; see `upright.control.sensors.scales`.

    Parameters
    ----------
    log : Record
        Columns named as the coordinates, in any unit or in counts, and the command ``u``, from rest.
    known : mapping of str to float, optional
        How well the model's numbers are known.

    Raises
    ------
    BadInput
        When a column is missing or has another dimension.
    NotIdentifiable
        When the model says that the commands swing the pendulum too little.
    """
    signals = {"u": log["u"]} if "u" in log.names else {}
    if not signals:
        raise BadInput(f"the check needs the command in a column 'u'; {nearest('u', log.names)}")
    for i, c in enumerate(model.plant.coordinates):
        if c.name not in log.names:
            raise BadInput(f"the check needs a column '{c.name}'; {nearest(c.name, log.names)}")
        unit = log.units.get(c.name, "") or c.unit
        if unit == "counts":
            size = float(model.resolution[i])
        elif same_dimension(unit, c.unit):
            size = scale(unit)
        else:
            raise BadInput(f"'{c.name}' is in {unit}, and {c.unit} or counts were needed; say so in the log's header.")
        signals[c.name] = (log[c.name] - log[c.name][0]) * size
    units = {c.name: c.unit for c in model.plant.coordinates} | {"u": model.unit}
    result = scales(model, log.replace(signals=signals, units=units, inputs=("u",), outputs=tuple(signals)[1:]), known)
    true = np.abs(result.motion[:, 1] / result.value[1]).max()
    if true < LEAST:
        raise NotIdentifiable(
            f"by the model the pendulum swings to {math.degrees(true):.0f} degrees only, where its period hardly tells "
            f"its amplitude; drive it to {math.degrees(LEAST):.0f} or more, 100 is best, then let it coast."
        )
    return result


def run_swing_up(
    model: Rig,
    stand: TestStand,
    folder: Path,
    progress: Progress = silent,
    stopped: Callable[[], bool] = lambda: False,
    *,
    known: Mapping[str, float] | None = None,
    seconds: float = SECONDS,
    travel: float | None = None,
    source: str = "",
) -> SwingUpRun:
    """Check the encoders of a hanging rig, swing it up and hold it; then try what faulty encoders would do to a twin.

    Parameters
    ----------
    model : Rig
        As known: as designed, or as identified.
    stand : TestStand
        The rig itself.
    folder : Path
        Takes ``sensors.csv`` and ``swing_up.csv``.
    progress : callable, optional
        Called with the current step and the share completed.
    stopped : callable, optional
        Called before the faulty encoders: whether to leave them out.
    known : mapping of str to float, optional
        How well the model's numbers are known, see `known_of`; `sensors.KNOWN` when omitted.
    seconds : float
        How long the swing-up may take, holding included.
    travel : float, optional
        How far the driven body may go [m or rad]; what the rig says when omitted.
    source : str
        File that the model comes from, as typed.

    Raises
    ------
    RigStopped
        When a live rig was stopped, or did not begin.
    """
    began = time.perf_counter()
    progress("designing swing-up and catch", 0.0)
    room = stand.travel if travel is None and math.isfinite(stand.travel) else travel
    law = design_swing_up(model, travel=room, speeds=stand.speeds)
    progress("checking the encoders", 0.3)
    command = probe(model, law)
    log = _coasted(stand, command, folder)
    check = scales(model, log, known)
    progress("swinging up", 0.4)
    ascent = _ascended(stand, law, folder, seconds) if check.sound else None
    tried: tuple[FaultyEncoder, ...] = ()
    if stand.exact is not None and check.sound and not stopped():
        progress("trying faulty encoders", 0.6)
        tried = _faulty_encoders(model, stand.exact, law, command, known)
    log.to_csv(folder / "sensors.csv")
    if ascent is not None:
        ascent.trial.record.to_csv(folder / "swing_up.csv")
    return SwingUpRun(
        model=model, truth=stand.exact or model, log=log, check=check, law=law, ascent=ascent,
        faulty=tried,
        source=source, folder=folder, seconds=time.perf_counter() - began, performed=stand.performed,
    )  # fmt: skip


def _coasted(stand: TestStand, command: Array, folder: Path) -> Record:
    """What the encoders show, from where the rig hangs at rest, under commands put out blindly."""
    _ask(stand, "the drive swings it, then lets it coast")
    log = stand.run([*command.tolist(), 0.0], folder, "sensors")
    names = stand.names
    signals = {**{n: log[n] - log[n][0] for n in names}, "u": log[APPLIED]}
    units = {**{n: log.units[n] for n in names}, "u": stand.rig.unit}
    return log.replace(t=log.t - log.t[0], signals=signals, units=units, inputs=("u",), outputs=tuple(names))


def _ascended(stand: TestStand, law: SwingUp, folder: Path, seconds: float) -> Ascent:
    _ask(stand, "after a small pulse it is swung up, around and caught: keep well away")
    rule = law.rule(stand.rig, stand.rig.plant.state(stand.resting))
    run = stand.hold(rule, "inverted", folder, "swing_up", seconds)
    if run.ended:
        raise RigStopped(f"The swing-up was stopped {run.trial.t[-1]:.3g} s after its start: {run.ended}")
    return ascent_of(run.trial, law, rule)


def _ask(stand: TestStand, what: str) -> None:
    driven, pendulum = stand.names
    stand.ask(f"Let {pendulum} hang at rest, with {driven} in the middle of its travel; {what}.")


def _faulty_encoders(
    model: Rig,
    truth: Rig,
    law: SwingUp,
    command: Array,
    known: Mapping[str, float] | None,
    seconds: float = 2.0,
) -> tuple[FaultyEncoder, ...]:
    names = [c.name for c in model.plant.coordinates]
    sampled = model.linear("inverted").to_sampled(model.period, (model.delay + model.lag) / model.period)
    law_upright = feedback(filtered(sampled, law.memory), law.K[None])
    factors = [(name or names[0], factor) for name, factor in FAULTS]
    checks: list[Scales] = []
    runs: list[tuple[Array, Array, Array]] = []
    for name, factor in factors:
        rig = replace(truth, scales=tuple(factor if n == name else 1.0 for n in names))
        checks.append(scales(model, shown_by_encoders(rig, command), known))
        rest = readings(rig, list(rig.plant.equilibrium("inverted").values()))  # zeroed by a hand that holds it upright
        went = trial(rig, law_upright, at="inverted", start=[0.0, 0.0, TILT, 0.0], seconds=seconds, rest=rest)
        measured = np.column_stack([went.record[n] for n in names]) - rest
        runs.append((measured, went.u, np.abs(went.deviation[:, 1])))
    alarm = Watch(model).over(np.stack([r[0] for r in runs], axis=-1), np.column_stack([r[1] for r in runs]))
    out: list[FaultyEncoder] = []
    for i, (name, factor) in enumerate(factors):
        at, column, away = int(alarm.sample[i]), names.index(name), runs[i][2]
        beyond = np.flatnonzero(away > FALLEN)
        out.append(
            FaultyEncoder(
                name=name, factor=factor, estimate=float(checks[i].value[column]), error=float(checks[i].error[column]),
                refused=name in checks[i].wrong, spoke=at * model.period if at >= 0 else math.inf,
                tilt=float(away[at]) if at >= 0 else 0.0,
                suspicion=str(alarm.what[i]) if alarm.what[i] != Suspicion() else "",
                fell=float(beyond[0]) * model.period if beyond.size else math.inf,
            )
        )  # fmt: skip
    return tuple(out)
