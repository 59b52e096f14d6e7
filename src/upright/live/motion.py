"""The page in which a run is played: the rig as measured, as simulated, or both, at the time that a person chooses."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from upright.errors import BadInput
from upright.live.page import page_source, source_hash, still
from upright.physics import Plant
from upright.physics.outline import in_javascript
from upright.records import Array
from upright.report.html import rendered
from upright.report.interactive.script import in_script
from upright.report.interactive.traces import extreme_rows, packed
from upright.report.symbols import plain

RATE = 60.0
"""Pictures a second at most: a screen shows no more."""
MOST = 3600
"""Pictures of a run at most, a minute of it; a longer run has fewer a second."""
POINTS = 600
"""Points of a trace at most, two for every third pixel of its width."""


def motion_page(
    plant: Plant,
    t: Array,
    measured: Mapping[str, Array],
    simulated: Mapping[str, Array],
    *,
    name: str,
    performed: str = "",
    remark: str = "",
) -> str:
    """The page of a run.

    Parameters
    ----------
    plant : Plant
        Drawn to scale from its numbers.
    t : array, shape (N,)
        Times [s].
    measured, simulated : mapping of str to array, shape (N,)
        Motion by coordinate [rad or m]; where one is empty, the other is drawn alone; what neither has stands at zero.
    name : str
        Of the run.
    performed : str
        `basis.SIMULATED` or `basis.REPLAYED` where no rig was driven.
    remark : str
        What else a reader must know.

    Raises
    ------
    BadInput
        When the plant does not say how it is drawn, or the motion is not finite.
    """
    from markupsafe import Markup

    coordinates = list(plant.coordinates)
    outline = in_javascript(partial(plant.outline, plant), len(coordinates))
    if not outline:
        raise BadInput(f"play needs a plant that says how it is drawn; give {type(plant).__name__} its outline(p, q).")
    first, seconds = float(t[0]), float(t[-1] - t[0])
    frames = int(min(MOST, max(2, seconds * RATE + 1)))
    grid = first + np.linspace(0, seconds, frames)
    columns = [
        tuple(np.interp(grid, t, of[c.name]) if c.name in of else None for of in (measured, simulated))
        for c in coordinates
    ]
    if not all(np.isfinite(s).all() for _, s in columns if s is not None):
        raise BadInput(f"the simulated motion of {name} grows beyond all bounds, so it cannot be shown.")
    step = seconds / (frames - 1)
    seldom = f"; a picture every {step:.2g} s, traces with every extreme" if frames == MOST else ""
    data = {
        "frames": frames, "step": step, "start": first,
        "coordinates": [
            {"name": c.name, "unit": c.unit}
            | {of: None if x is None else packed(x) for of, x in zip(("measured", "simulated"), both, strict=True)}
            for c, both in zip(coordinates, columns, strict=True)
        ],
    }  # fmt: skip
    style = page_source("play.css")
    run = f"const RUN = {in_script(data)};\nconst OUTLINE = {outline};"
    script = "\n".join([page_source("drawing.js"), run, page_source("motion.js")])
    first_shown = [next((float(x[0]) for x in reversed(both) if x is not None), 0.0) for both in columns]
    view, picture = still(plant, first_shown)
    kinds = [kind for kind, of in (("measured", measured), ("simulated", simulated)) if of]
    what = "measured (pale, wide) and simulated" if len(kinds) == 2 else kinds[0]
    return rendered(
        "upright.live", "motion.html",
        policy=f"default-src 'none'; script-src {source_hash(script)}; style-src {source_hash(style)}",
        style=Markup(style), script=Markup(script), picture=Markup(picture), view=view, name=name, frames=frames,
        what=what, performed=performed,
        strips=[_strip(c.name, c.unit, t, measured.get(c.name), simulated.get(c.name)) for c in coordinates],
        drawn=f"Drawn to scale from the plant's numbers, rods as if uniform{seldom}.", remark=remark,
    )  # fmt: skip


def _strip(name: str, unit: str, t: Array, measured: Array | None, simulated: Array | None) -> dict[str, str]:
    """Lines of one coordinate over times t, in a box of 1000 by 100; empty where there are none."""
    base = simulated if measured is None else measured
    if base is None:
        return {}
    low, high = float(base.min()), float(base.max())
    room = 0.1 * (high - low) or 1e-3
    low, high = low - room, high + room
    scale, of = (180 / np.pi, "deg") if unit == "rad" else (100.0, "cm")
    span = f"{scale * low:.3g} to {scale * high:.3g} {of}".replace("-", "\u2212")
    lines = {
        kind: "" if values is None else _points(t, np.clip(values, low, high), low, high)
        for kind, values in (("measured", measured), ("simulated", simulated))
    }
    return {"symbol": plain(name), "range": f"[{span}]", "label": f"{plain(name)} over time, from {span}", **lines}


def _points(t: Array, values: Array, low: float, high: float) -> str:
    rows = extreme_rows([values], values.size, POINTS)
    x, y = 1000 * (t[rows] - t[0]) / (t[-1] - t[0]), 100 * (high - values[rows]) / (high - low)
    return " ".join(f"{a:.4g},{b:.4g}" for a, b in zip(x, y, strict=True))
