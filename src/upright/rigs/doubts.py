"""Warnings to the supervisor while a pendulum is stabilised: which of encoders and drive is likely not what it was."""

from __future__ import annotations

from collections.abc import Sequence

from upright.control.dead_encoder import StillDrive, StillPendulum
from upright.control.watch import Suspicion, Watch
from upright.rig import Rig
from upright.rigs.protocol import Fault


class Doubts:
    """The watch of a loop and its two counters, fed sample by sample.

    Parameters
    ----------
    model : Rig
        As identified; a pendulum on a driven body.
    at : str
        Equilibrium that is held.
    name : str
        Of the rig, for sentences.
    """

    def __init__(self, model: Rig, at: str, name: str) -> None:
        self._name = name
        self.body_trusted = False
        """Whether what was found wrong leaves the driven body's encoder and the drive sound."""
        self._watch = Watch(model, at)
        self._drive, self._pendulum = StillDrive(model, at), StillPendulum(model, at)

    def sees(self, readings: Sequence[float], away: Sequence[float], command: float) -> tuple[Fault, str] | None:
        """Take a sample and the command that drives the rig after it; what is wrong, if anything is."""
        self._watch.see([away], command)
        for still, held in ((self._drive.sees(readings[self._drive.which], away, command), self._drive),
                            (self._pendulum.sees(away), self._pendulum)):  # fmt: skip
            if still and held is self._drive and self._drive.rests:
                return Fault.MODEL, (
                    f"{held.name} does not move as its command must have moved it; likeliest is that the drive gives "
                    "too little, or something holds it fast. Check supply, cable and current limit."
                )
            if still:
                self.body_trusted = held is self._pendulum
                moved = "its command must have moved it" if held is self._drive else "what carries it was accelerated"
                return Fault.ENCODER, (
                    f"{held.name} shows not a single count although {moved}: its encoder is dead, or something holds "
                    "it fast."
                )
        if not self._watch.speaks()[0][0]:
            return None
        likely = self._watch.likely()
        self.body_trusted = bool(likely) and all(s.name == self._pendulum.name for s in likely)
        return Fault.MODEL, f"{self._name} does not move as its model does; {self._named(likely)}"

    @property
    def likeliest(self) -> str:
        """What may be wrong when something else stopped the rig, as a sentence behind others; "" when nothing is."""
        likely = self._watch.likely()
        return f" {self._named(likely)[0].upper()}{self._named(likely)[1:]}" if likely else ""

    def _named(self, likely: tuple[Suspicion, ...]) -> str:
        if not likely:
            return "not sure why. Look at supply, cables and encoders (upright rig doctor)."
        first, *others = likely
        which = f"likeliest is {first}" if not others else f"not sure why: {' or '.join(map(str, likely))}"
        return f"{which}. {first.advice}; if a hand pushed it, start again."
