"""Would a supervisor let a lane begin, or go on, under these gains? By the model of the rig, beside all lanes."""

from __future__ import annotations

import threading

import numpy as np

from upright.browser.rig import BenchRig
from upright.errors import BadInput
from upright.laws import Law
from upright.running.rig import about_what_is_held, stage_of


class Judge:
    """The supervisor of a twin that nobody moves, which is held by a rig's law.

    Attributes
    ----------
    law : Law
        Of the rig, as it begins.
    about : Capabilities
    held : Limits
    target : tuple of float
        What is held, as the encoders show it.
    lean : float
        How far the last coordinate may be from it.
    units : tuple of str
        Of the coordinates.

    Raises
    ------
    RigStopped
        When no run would begin under this law.
    """

    def __init__(self, rig: BenchRig) -> None:
        stage = stage_of(rig.rig_path, balance=True)
        self._beside, self._lock, self.units = stage.supervisor, threading.Lock(), stage.units
        self.about = self._beside.prepare()
        stage.bring()
        law = self._beside.aim(about_what_is_held(rig.law, rig.model, rig.at, rig.zero))
        assert isinstance(law, Law)  # as the one it was made of
        self._beside.start()
        self.law, self.held, self.target = law, self._beside.held, self._beside.target
        self.lean = self._beside.duty.lean

    def of(self, law: Law) -> tuple[str, Law]:
        """Why gains would be refused, or an empty text; and the law as it runs."""
        with self._lock:
            why = self._beside.change(law)
            fitted = self._beside.law
        assert isinstance(fitted, Law)  # no other is changed
        return why, fitted

    def check_alike(self, law: Law) -> None:
        """Refuse a law that differs from this rig's by more than its gains.

        Raises
        ------
        BadInput
            When it does.
        """
        mine = self.law
        alike = [np.array_equal(getattr(law, name), getattr(mine, name)) for name in ("A", "B", "target")]
        if not all(alike) or law.D.shape != mine.D.shape or law.limit != mine.limit:
            raise BadInput(
                "the law designed for this fit has another velocity filter, limit or reference than that of the class, "
                "whose twins differ by gains alone."
            )
