"""Where did a record come from, and what was done to it on the way?"""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True, kw_only=True)
class Provenance:
    """Where a record came from.

    `window` is empty, or (first, last) time in s of the part kept; `notes` are sentences about what
    the reader did or found, in order.
    """

    file: str = ""
    sha256: str = ""
    reader: str = ""
    rig: str = ""
    window: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()

    def note(self, *sentences: str) -> Provenance:
        """Same provenance with sentences added."""
        return replace(self, notes=(*self.notes, *sentences))


def of_twin(rig: str, seed: int) -> Provenance:
    """Provenance of a simulated log, which says so wherever it goes."""
    return Provenance(
        reader="twin",
        rig=f"digital twin of {rig}, seed {seed}",
        notes=("This log was simulated; no rig was touched.",),
    )
