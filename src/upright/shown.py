"""How does a value show itself in a notebook or at a prompt? As the views above it say, fetched when somebody looks."""

from __future__ import annotations

from importlib import import_module
from typing import Any


class Shown:
    """A value that can be looked at: short as text, as a table in a notebook, as a picture.

    What it looks like is not said here, since a value knows no report and no figure, but in `upright.views`, which
    is found by name when the value is first shown.
    """

    __slots__ = ()

    def __repr__(self) -> str:
        return _views().text(self)

    def _repr_html_(self) -> str:
        return _views().html(self)

    def plot(self, *names: str) -> Any:
        """A `matplotlib.figure.Figure` of it; `names` are the columns of a record to draw."""
        return _views().plot(self, *names)


def _views() -> Any:
    return import_module("upright.views")
