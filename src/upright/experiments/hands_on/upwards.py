"""Experiment 2b at a rig: its encoders are asked while it hangs, then the drive swings it up and catches it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from upright.control import SwingUp
from upright.control.swing_up import Ascent, ascent_of
from upright.errors import RigStopped
from upright.experiments.hands_on.rig import RigAtHand, trial_of
from upright.experiments.swing_up_2b.run import SwingUpRun, known_of, run_swing_up
from upright.progress import Progress
from upright.readers import read
from upright.records import Array, Record
from upright.report.symbols import typed
from upright.study.stored_rig import read_stored_rig


@dataclass(frozen=True, kw_only=True, eq=False)
class _Hands:
    rig: RigAtHand
    folder: Path

    def coast(self, command: Array) -> Record:
        self._rest("the drive swings it, then lets it coast")
        log = read(self.rig.put_out([*command.tolist(), 0.0], self.folder, "sensors"))
        names = self.rig.names
        signals = {"u": log["u_applied"], **{n: log[n] - log[n][0] for n in names}}
        units = {"u": self.rig.model.unit, **{n: log.units[n] for n in names}}
        return log.replace(
            t=log.t - log.t[0], signals=signals, units=units, inputs=("u",), outputs=tuple(names)
        )  # fmt: skip

    def ascend(self, law: SwingUp, seconds: float) -> Ascent:
        self._rest("after a small pulse it is swung up, around and caught: keep well away")
        model = self.rig.model
        rule = law.rule(model, model.plant.state(self.rig.resting))
        done = self.rig.hold(rule, self.folder, "swing_up", seconds, from_rest=True)
        if done.end.stopped:
            raise RigStopped(f"The swing-up was stopped {done.t[-1]:.3g} s after its start: {done.end.stopped}")
        held, zero = (model.plant.equilibrium(n) for n in ("inverted", self.rig.resting))
        # its law counts the driven body from where the encoders were zeroed, wherever the pulse has left it
        return ascent_of(trial_of(done, "inverted", [held[n] - zero[n] for n in self.rig.names]), law, rule)

    def _rest(self, what: str) -> None:
        names = self.rig.names
        self.rig.requested(f"Let {names[-1]} hang at rest, with {names[0]} in the middle of its travel; {what}.")


def run_upwards(
    rig: RigAtHand, fit: Path, folder: Path, progress: Progress, stopped: Callable[[], bool]
) -> SwingUpRun:  # fmt: skip
    """Check the encoders of the hanging rig, swing it up and hold it; leaves `rig.toml`, the law and logs.

    Raises
    ------
    RigStopped
        When the rig was stopped, or did not begin.
    """
    held = rig.described_by(fit, folder / "rig.toml")
    return run_swing_up(
        held.model, held.model, folder, progress, stopped, known=known_of(read_stored_rig(fit)), lies=False,
        source=typed(fit), at_hand=_Hands(rig=held, folder=folder),
    )  # fmt: skip
