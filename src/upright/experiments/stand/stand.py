"""What an experiment can ask of a rig: put out a signal, run a law, and ask the person beside it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from upright.basis import SIMULATED
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
    ended: str | None = None
    overtravel: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class TestStand(ABC):
    """A rig on which experiments are made; a twin and hardware answer alike.

    Attributes
    ----------
    attended : bool
        Whether a person is beside it, whose time counts and who does what no drive can.
    starts_anywhere : bool
        Whether it can be let go in any state, with its bodies freed, clamped and loaded as an experiment likes.
    may_fall : bool
        Whether nothing is hit when a pendulum falls or a body leaves its travel.
    rig : Rig
        What is run. Of a twin that is simulated here these are the true numbers, else those of its description.
    true_rig : Rig or None
        What a twin behind the protocol truly is.
    make : Make or None
        None of a rig of one's own.
    vendor : str, optional
        Whose data sheet says what a fit of it does not.
    performed : str
        `basis.SIMULATED` where no rig is driven.
    zero : str, optional
        Equilibrium at which the encoders are zeroed; the plant's first when omitted, or where it has no such.
    room : float
        How far the driven coordinate may go [m or rad], where that is less than the rig itself says.
    speeds : tuple of float
        Limits of the coordinates' speeds [rad/s or m/s], beyond which a run is stopped; empty where only the rig itself
        says one.
    fit : Path or None
        What describes it already, so that nothing of it is left to identify.
    study : Path or None
        What its owner says of it, from which an identification starts; none of a make's twin.
    added, tolerance : tuple of str, float
        Known inertias that can be bolted to its first body one after the other, as their owner says them, and the
        relative standard uncertainty of a piece.
    """

    attended: ClassVar[bool]
    starts_anywhere: ClassVar[bool]
    may_fall: ClassVar[bool]
    rig: Rig
    true_rig: Rig | None = None
    make: Make | None = None
    vendor: str | None = None
    performed: str = SIMULATED
    zero: str | None = None
    room: float = math.inf
    speeds: tuple[float, ...] = ()
    fit: Path | None = None
    study: Path | None = None
    added: tuple[str, ...] = ()
    tolerance: float = 0.0

    @property
    def names(self) -> list[str]:
        """Coordinates, in the plant's order."""
        return [c.name for c in self.rig.plant.coordinates]

    @property
    def resting(self) -> str:
        """Equilibrium at which the encoders are zeroed."""
        kinds = self.rig.plant.equilibria
        return self.zero if self.zero is not None and self.zero in kinds else next(iter(kinds))

    @property
    def travel(self) -> float:
        """How far the driven coordinate may go [m or rad]."""
        return min(self.rig.travel, self.room)

    @property
    def twin(self) -> Rig:
        """What a twin truly is; of hardware its description."""
        return self.rig if self.true_rig is None else self.true_rig

    @property
    def exact(self) -> Rig | None:
        """The rig with its true numbers, where an experiment may compute with them; None where it is not to know."""
        return None

    @property
    def truth(self) -> Mapping[str, float]:
        """Numbers of a twin by name, `actuator.*` included; empty of hardware, whose numbers nobody knows."""
        return {**self.twin.plant.parameters(), **self.twin.drive} if self.performed else {}

    @abstractmethod
    def ask(self, sentence: str) -> None:
        """Ask the person beside the rig for something.

        Raises
        ------
        RigStopped
            When it was not done.
        """

    @abstractmethod
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

    @abstractmethod
    def hold(
        self, law: Law | Rule, at: str, folder: Path, stem: str, seconds: float, *, start: Array | None = None,
        reference: Array | None = None, pushes: Array | None = None,
    ) -> StandRun:  # fmt: skip
        """A run of a law.

        Parameters
        ----------
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

    @abstractmethod
    def described_by(self, fit: Path, folder: Path) -> TestStand:
        """The same rig, as a fit describes it to whoever watches its runs; what that takes is written to the folder."""


def file_of(log: Record) -> str:
    """Name of the file that a stand left of a log."""
    return Path(log.provenance.file or "").name
