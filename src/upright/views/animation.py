"""A record of a rig as a moving drawing: a pendulum, a cart or an arm with one, or bodies on a line."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from upright.errors import BadInput
from upright.physics import PLANTS
from upright.records import Record
from upright.report.drawing import BLUE, GREY, VERMILLION, figure

Array = NDArray[np.float64]


def animated(record: Record, *, plant: Any = None, speed: float = 1.0, frames: int = 25) -> Any:
    """Moving drawing of a record whose columns bear the names of coordinates; a notebook plays it.

    Parameters
    ----------
    record : Record
        With ``theta`` [rad], and ``x`` [m] or ``psi`` [rad] where the pendulum stands on a cart or an arm; or with
        ``x_1, x_2, ...`` [m] or ``theta_1, theta_2, ...`` [rad].
    plant : Plant or its class, optional
        Whose `drawing` is drawn; that of the record's own rig when omitted.
    speed : float
        Times faster than the motion was.
    frames : int
        Per second.

    Returns
    -------
    matplotlib.animation.FuncAnimation
        ``.to_jshtml()`` is a page of it, ``.save("run.gif")`` a file.

    Raises
    ------
    BadInput
        When no column can be drawn, or a number is not above zero.
    """
    from matplotlib.animation import FuncAnimation

    if not (speed > 0 and frames > 0):
        raise BadInput(f"animate needs speed and frames above 0, got {speed:g} and {frames:g}.")
    for name in record.signals:
        if name in ("theta", "psi") and record.units[name] not in ("rad", ""):
            raise BadInput(f"animate draws angles in rad, and '{name}' is in {record.units[name]}; convert it first.")
    moments = np.arange(record.t[0], record.t[-1], speed / frames)
    q = {name: np.interp(moments, record.t, values) for name, values in record.signals.items()}
    kinds = (kind for kind in PLANTS.sound().values() if kind.__name__ == record.provenance.rig)
    kind = plant or next(kinds, None)
    own = kind.drawing(q) if kind else []
    lines = own or (_pendulum(q) if "theta" in q else _bodies(q))
    if not lines:
        raise BadInput(
            "animate draws columns called theta, x, psi, or x_1, x_2, ..., and the record has "
            f"{', '.join(record.signals)}; rename them."
        )
    drawing = figure(3.2)
    axes = drawing.subplots()
    axes.set_aspect("equal")
    reach = max(float(np.abs(line).max()) for line in lines) * 1.15
    axes.set_xlim(-reach, reach)
    axes.set_ylim(*((-reach, reach) if own else (-1.3, 1.3)))
    axes.axhline(0.0, color=GREY, linewidth=0.8)
    axes.set_yticks([])
    drawn = [axes.plot([], [], color=c, marker="o", linewidth=2)[0] for c, _ in zip((BLUE, VERMILLION) * 8, lines)]  # noqa: B905
    clock = axes.set_title("")

    def show(i: int) -> list[Any]:
        for artist, line in zip(drawn, lines, strict=True):
            artist.set_data(line[i, 0], line[i, 1])
        clock.set_text(f"{moments[i]:.2f} s")
        return [*drawn, clock]

    played = FuncAnimation(drawing, show, frames=len(moments), interval=1000 / frames, blit=False)
    played._repr_html_ = played.to_jshtml  # type: ignore[attr-defined, method-assign]
    return played


def _pendulum(q: dict[str, Array]) -> list[Array]:
    """Support and rod, shape (moments, 2, points): from the side, an arm as its bearing goes round."""
    support = q["x"] if "x" in q else np.sin(q["psi"]) if "psi" in q else np.zeros_like(q["theta"])
    zero = np.zeros_like(support)
    rod = np.stack([np.stack([support, support + np.sin(q["theta"])], 1), np.stack([zero, -np.cos(q["theta"])], 1)], 1)
    if "x" in q or "psi" in q:
        start = support - 0.15 if "x" in q else zero
        stop = support + 0.15 if "x" in q else support
        return [np.stack([np.stack([start, stop], 1), np.stack([zero, zero], 1)], 1), rod]
    return [rod]


def _bodies(q: dict[str, Array]) -> list[Array]:
    """Carts on a rail, or disks seen from the front as hands of a clock, side by side."""
    carts = sorted(n for n in q if n.startswith("x_") and n[2:].isdigit())
    if carts:
        largest = max(float(np.abs(q[n]).max()) for n in carts) or 1.0
        places = [q[n] / largest + 3 * i for i, n in enumerate(carts)]
        return [np.stack([np.stack([x - 0.4, x + 0.4], 1), np.zeros((x.size, 2))], 1) for x in places]
    disks = sorted(n for n in q if n.startswith("theta_") and n[6:].isdigit())
    return [
        np.stack(
            [np.stack([np.full(q[n].size, 3.0 * i), 3.0 * i + np.sin(q[n])], 1),
             np.stack([np.zeros(q[n].size), np.cos(q[n])], 1)], 1,
        )
        for i, n in enumerate(disks)
    ]  # fmt: skip
