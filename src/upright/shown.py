"""How does a value show itself in a notebook or at a prompt? As the views above it say, fetched when somebody looks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


class Shown:
    """A value that can be looked at: short as text, as a table in a notebook, as a picture.

    What it looks like is not said here, since a value knows no report and no figure; the front door says who does
    (`look_with`), which is called when a value is first shown.
    """

    __slots__ = ()

    def __repr__(self) -> str:
        return views().text(self)

    def _repr_html_(self) -> str:
        return views().html(self)

    def plot(self, *names: str) -> Any:
        """A `matplotlib.figure.Figure` of it; `names` are the columns of a record to draw."""
        return views().plot(self, *names)


_views: list[Callable[[], Any]] = []


def look_with(views: Callable[[], Any]) -> None:
    """Say which module knows how values look; it is imported when the first one is shown."""
    _views[:] = [views]


def views() -> Any:
    """That module."""
    return _views[0]()
