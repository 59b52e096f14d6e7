"""What an experiment can ask of a rig: put out a signal, run a law, and ask the person beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from upright.control.trial import Trial
from upright.laws import Law, Rule
from upright.records import Array, Record
from upright.rig import Rig
from upright.rig.makes import Make

APPLIED = "u_applied"
"""Column of the command as it was applied."""


@dataclass(frozen=True, kw_only=True, eq=False)
class StandRun:
    """A law at work: what was logged, and where it was ended early, why in a sentence.

    `overtravel` says that it was ended since the driven body left its travel.
    """

    trial: Trial
    ended: str = ""
    overtravel: bool = False


class TestStand(Protocol):
    """A rig on which experiments are made; a twin and hardware answer alike."""

    @property
    def rig(self) -> Rig:
        """What is run. Of a twin that is simulated here these are the true numbers, else those of its description."""
        ...

    @property
    def names(self) -> list[str]:
        """Coordinates, in the plant's order."""
        ...

    @property
    def make(self) -> Make | None:
        """None of a rig of one's own."""
        ...

    @property
    def simulated(self) -> bool:
        """Whether it is simulated here, and no fall or limit matters; a twin behind the protocol is not."""
        ...

    @property
    def performed(self) -> str:
        """`basis.SIMULATED` where no rig is driven."""
        ...

    @property
    def vendor(self) -> str:
        """Whose data sheet says what a fit of it does not; may be empty."""
        ...

    @property
    def fit(self) -> Path | None:
        """What describes it already, so that nothing of it is left to identify."""
        ...

    @property
    def study(self) -> Path | None:
        """What its owner says of it, from which an identification starts; none of a make's twin."""
        ...

    @property
    def added(self) -> tuple[str, ...]:
        """Known inertias that can be bolted to its first body one after the other, as their owner says them."""
        ...

    @property
    def tolerance(self) -> float:
        """Relative standard uncertainty of a piece of these."""
        ...

    @property
    def travel(self) -> float:
        """How far the driven coordinate may go [m or rad]."""
        ...

    @property
    def resting(self) -> str:
        """Equilibrium at which the encoders are zeroed."""
        ...

    @property
    def twin(self) -> Rig:
        """What a twin truly is; of hardware its description."""
        ...

    @property
    def truth(self) -> Mapping[str, float]:
        """Numbers of a twin by name, `actuator.*` included; empty of hardware, whose numbers nobody knows."""
        ...

    def ask(self, sentence: str) -> None:
        """Ask the person beside the rig for something.

        Raises
        ------
        RigStopped
            When it was not done.
        """
        ...

    def run(
        self, samples: Sequence[float], folder: Path, stem: str, *, lifted: float = 0.0, bolted: float = 0.0
    ) -> Record:  # fmt: skip
        """Log of a signal put out blindly, a sample each period, from rest; it is also left as a file.

        Parameters
        ----------
        samples : sequence of float
            [command unit].
        folder, stem
            Where the file goes; the record's provenance names it.
        lifted : float
            How far a hand lifts the last coordinate before it lets go; done for a twin here, by a person else.
        bolted : float
            Inertia that a hand adds to the first body [kg or kg m^2]; likewise.

        Returns
        -------
        Record
            Readings by coordinate [m or rad] and the command as it was applied, `APPLIED`.

        Raises
        ------
        RigStopped
            When it did not run to its end.
        KeyboardInterrupt
            When somebody stopped it.
        """
        ...

    def hold(
        self, law: Law | Rule, at: str, folder: Path, stem: str, seconds: float, *, start: Array | None = None,
        reference: Array | None = None, pushes: Array | None = None,
    ) -> StandRun:  # fmt: skip
        """A run of a law.

        Parameters
        ----------
        law : Law or Rule
        at : str
            Equilibrium to hold.
        folder, stem
            Where files of the run go.
        seconds : float
            From the first sample to the last.
        start : array, shape (states,), optional
            Deviation from the equilibrium where the rig is let go; a person can only bring the last coordinate there.
            Without it the run begins where the rig rests.
        reference, pushes : array, shape (T,), optional
            What the law follows, and what is added to its command before the limit, sample by sample.

        Raises
        ------
        RigStopped
            When no loop began.
        KeyboardInterrupt
            When somebody stopped it.
        """
        ...

    def described_by(self, fit: Path, folder: Path) -> TestStand:
        """The same rig, as a fit describes it to whoever watches its runs; what that takes is written to the folder."""
        ...


def file_of(log: Record) -> str:
    """Name of the file that a stand left of a log."""
    return Path(log.provenance.file).name
