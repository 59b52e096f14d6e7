"""Where do the poles lie, before and after, and how does the rig come back?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from upright.report.drawing import (
    BLUE,
    GREY,
    ORANGE,
    VERMILLION,
    figure,
    hide_inner_times,
    limits,
    roots,
    s_plane,
    styled,
)
from upright.report.symbols import axis, mathtext

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Roots = NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True)
class Poles:
    """Poles [1/s] of one kind with their mark: ``x`` open loop, ``o`` asked, ``+`` attained."""

    name: str
    values: Roots
    mark: str
    colour: str


@styled
def pole_map(kinds: Sequence[Poles], cloud: Roots | None = None, *, frame: int = 2) -> Figure:
    """Poles in the s-plane [1/s], the stable half shaded; `cloud` are those of the rigs that the fit allows.

    The view holds the first `frame` kinds; how many poles of the others lie outside is written below.
    """
    drawing = figure(4.2, width=6.2)
    ax: Any = drawing.subplots()
    seen = np.concatenate([k.values for k in kinds[:frame]])
    within = 1.3
    left, right = within * float(min(seen.real.min(), -1.0)), within * float(max(seen.real.max(), 1.0))
    high = within * float(max(np.abs(seen.imag).max(), 0.25 * (right - left)))
    ax.axvspan(left, 0.0, color=BLUE, alpha=0.06, linewidth=0)
    s_plane(ax)
    if cloud is not None and cloud.size:
        ax.plot(cloud.real, cloud.imag, ".", color=ORANGE, markersize=2, alpha=0.5, label="rigs that the fit allows")
    outside = 0
    for kind in kinds:
        v = kind.values
        roots(ax, v, kind.mark, kind.colour, kind.name, size=8 if kind.mark == "o" else 6)
        outside += int(np.sum((v.real < left) | (v.real > right) | (np.abs(v.imag) > high)))
    ax.set_xlim(left, right)
    ax.set_ylim(-high, high)
    more = f"; {outside} faster one{'s' if outside > 1 else ''} outside the picture" if outside else ""
    ax.set_xlabel(f"real part [1/s]{more}")
    ax.set_ylabel("imaginary part [rad/s]")
    ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return drawing


@styled
def swing_figure(
    t: Array, coordinates: dict[str, tuple[Array, str]], command: Array, unit: str, limit: float | None
) -> Figure:
    """Linear motion from a deviation: coordinates with their units, and the command with the drive's limit."""
    drawing = figure(1.4 * (len(coordinates) + 1) + 0.4)
    axes: list[Any] = drawing.subplots(len(coordinates) + 1, 1, sharex=True, squeeze=False)[:, 0].tolist()
    for ax, (name, (values, of)) in zip(axes, coordinates.items(), strict=False):
        ax.plot(t, values, color=BLUE)
        ax.set_ylabel(axis(mathtext(name), of))
    axes[-1].plot(t, command, color=VERMILLION)
    axes[-1].set_ylabel(axis("command", unit))
    if limit is not None:
        limits(axes[-1], limit, "limit", float(t[-1]))
        reach = 1.25 * max(limit, float(np.abs(command).max()))
        axes[-1].set_ylim(-reach, reach)
    hide_inner_times(axes)
    drawing.align_ylabels(axes)
    return drawing


@styled
def locus_figure(tracks: Roots, sets: dict[str, Roots], open_loop: Roots, *, origin: str = "open loop") -> Figure:
    """Poles as the effort's weight falls, shape (weights, n), with up to four named sets of poles on them.

    Only the upper half plane is drawn; the lower mirrors it.
    """
    drawing = figure(3.4)
    ax: Any = drawing.subplots()
    s_plane(ax)
    for i, track in enumerate(tracks.T):
        upper = track[track.imag >= -1e-9]
        label = "poles of least cost as effort gets cheaper" if i == 0 else None
        ax.plot(upper.real, upper.imag, ".", color=BLUE, markersize=1.5, label=label)
    roots(ax, open_loop[open_loop.imag >= -1e-9], "x", GREY, origin)
    for (name, poles), mark in zip(sets.items(), "osD^", strict=False):
        roots(ax, poles[poles.imag >= 0], mark, VERMILLION, name, size=8)
    every = np.concatenate([*sets.values(), open_loop])
    wide = float(np.ptp(every.real))
    ax.set_xlim(every.real.min() - 0.08 * wide, every.real.max() + 0.08 * wide)
    high = max(float(every.imag.max()), 0.1 * wide)
    ax.set_ylim(-0.06 * high, 1.15 * high)
    ax.set_ylabel("imaginary part [rad/s]")
    ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0))
    return drawing
