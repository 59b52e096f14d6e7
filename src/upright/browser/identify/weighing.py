"""A weighing that is on its way in a process of its own, and the last one."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from typing import Any

from upright.browser.answers import sentence_of
from upright.browser.identify.bounded import Bounded
from upright.browser.identify.tasks import begin_weighing
from upright.browser.rig import HARDWARE, BenchRig
from upright.errors import BadInput, UprightError

LONGEST = 120.0
"""Time that it may take [s]."""


class BodyWeighing:
    """The first body of a twin weighed, simulated.

    Parameters
    ----------
    carry : callable
        Makes a `Bounded`.
    """

    def __init__(self, carry: Callable[..., Bounded] = Bounded) -> None:
        self._carry, self._lock = carry, threading.Lock()
        self._job: Bounded | None = None
        self._facts: dict[str, Any] | None = None

    def begin(self, rig: BenchRig) -> None:
        """Begin to weigh.

        Raises
        ------
        BadInput
            When the rig can really move, or it is being weighed.
        """
        if rig.kind == HARDWARE:
            raise BadInput(
                "masses are bolted on by somebody beside the rig: upright lab --rig RIG.toml --experiment 1a."
            )
        with self._lock:
            if self._job is not None:
                raise BadInput("it is being weighed.")
            self._facts = {}
            self._job = self._carry(begin_weighing, rig.file, seconds=LONGEST, show=self._show)
        threading.Thread(target=self._run, args=(self._job,), name="weighing", daemon=True).start()

    def described(self) -> dict[str, Any] | None:
        """What there is so far, as JSON holds it; None where nobody weighed."""
        with self._lock:
            return None if self._facts is None else {**self._facts, "over": self._job is None}

    def close(self) -> None:
        """End what is on its way."""
        if self._job is not None:
            self._job.kill()

    def _show(self, facts: dict[str, Any]) -> None:
        with self._lock:
            self._facts = facts

    def _run(self, job: Bounded) -> None:
        facts: dict[str, Any] = {"failed": "It failed by a fault of the program; see what the server printed."}
        try:
            facts = json.loads(job.run())
        except UprightError as error:
            facts = {"failed": sentence_of(error)}
        finally:
            with self._lock:
                self._facts, self._job = facts, None
