"""Errors that a person is meant to read.

Every message has three parts: what was needed, what came, and what to try.
"""

from __future__ import annotations


class UprightError(Exception):
    """Base of every error a user is meant to read; the command line prints it without a traceback."""


class BadInput(UprightError, ValueError):
    """A file, study or argument that cannot be used as it is."""


class ImpossiblePhysics(UprightError, ValueError):
    """Parameters that no rig can have, such as a negative mass."""


class NotIdentifiable(UprightError, RuntimeError):
    """The data cannot answer this question."""


class RigStopped(UprightError, RuntimeError):
    """A rig refused, or stopped itself; its command was zero before this was raised."""

    def __init__(self, sentence: str) -> None:
        super().__init__(sentence[:1].upper() + sentence[1:])  # many begin with a rig's name, which is written small


class WorkersLost(UprightError, RuntimeError):
    """Processes or machines that were to share the work died, again and again."""


_MOST = 40  # names in a sentence


def nearest(name: str, valid: object) -> str:
    """Name the valid spelling closest to `name`, as a phrase, or list what exists."""
    from difflib import get_close_matches

    names = [str(v) for v in valid]  # type: ignore[attr-defined]
    close = get_close_matches(str(name)[:100], names, n=1, cutoff=0.6)
    if close:
        return f"did you mean '{close[0]}'?"
    more = f" and {len(names) - _MOST} more" if len(names) > _MOST else ""
    return f"valid names: {', '.join(sorted(names)[:_MOST])}{more}" if names else "nothing is defined here"
