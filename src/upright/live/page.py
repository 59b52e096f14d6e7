"""The page in which a rig moves: one file, from which no request leaves and in which nothing is evaluated."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

import numpy as np

from upright.live import SCRIPTS
from upright.live.twin import LONGEST_DELAY
from upright.physics import Plant
from upright.report.html import rendered
from upright.report.interactive.script import in_script as in_script


def page(
    data: Mapping[str, Any],
    plant: Plant,
    *,
    headline: str,
    cautions: Sequence[str],
    share: str,
    numbers: Sequence[tuple[str, str, str]],
    origin: str,
    start: str,
    seed: int,
) -> str:
    """The page of a twin.

    Parameters
    ----------
    data : mapping
        From `live.twin.moving`.
    cautions : sequence of str
        What stands against relying on it.
    share : str
        What becomes of the rigs that the fit allows, for paper and where no script runs.
    numbers : sequence of (str, str, str)
        Mark-up of symbols, meanings with units, values.
    origin : str
        Where the numbers of those rigs come from.
    start : str
        Where the rigs are let go.
    seed : int
        Of their draw.
    """
    from markupsafe import Markup

    style = page_source("play.css")
    numbers_of = in_script({k: v for k, v in data.items() if k != "outline"})
    known = f"const DATA = {numbers_of};\nconst OUTLINE = {data['outline']};"
    scripts = [*(path.read_text(encoding="utf-8") for path in SCRIPTS), page_source("drawing.js")]
    parts = [*scripts, known, "/* the page begins */", page_source("play.js")]
    script = "\n".join(parts)
    view, picture = still(plant, [*data["start"]][::2])
    driven = data["coordinates"][data["moved"]]["meaning"].rpartition(" of the ")[2]
    zero = "; ".join(f"{c['name']}: {c['meaning']}" for c in data["coordinates"])
    allowed = (
        f"script-src {source_hash(script)} 'wasm-unsafe-eval' blob:; worker-src blob:; style-src {source_hash(style)}"
    )
    return rendered(
        "upright.live", "play.html",
        policy=f"default-src 'none'; {allowed}",
        style=Markup(style), script=Markup(script), picture=Markup(picture), view=view, name=data["name"],
        headline=headline, cautions=cautions, share=share, origin=origin, start=start, seed=seed,
        numbers=[(Markup(mark), *rest) for mark, *rest in numbers],
        lanes=data["lanes"], seconds=f"{data['seconds']:g}", period=f"{1e3 * data['period']:.4g} ms",
        longest=f"{1e3 * LONGEST_DELAY:g}", driven=driven,
        drawn=f"Drawn to scale from the plant's numbers, rods as if uniform. {zero}.",
    )  # fmt: skip


def still(plant: Plant, q: Sequence[float]) -> tuple[str, str]:
    """View box and lines of a plant's picture at coordinates `q`, as `play.js` draws it."""
    lines = [(name, np.array(points, dtype=np.float64)) for name, points in plant.outline(plant, list(q))]
    lines += [(name, np.array(points, dtype=np.float64)) for name, points in plant.outline(plant, [0.0] * len(q))]
    every = np.vstack([points for _, points in lines])
    turned, raised = (0.0, 0.0) if not every[:, 1].any() else np.radians([25.0, 20.0])
    far = float(np.linalg.norm(every, axis=1).max())
    high = max(float(np.abs(every[:, 2]).max()), far / 2)
    names = [c.name for c in plant.coordinates]
    drawn: list[str] = []
    for name, points in lines[: len(lines) // 2]:
        x, y, z = points.T
        across = x * np.cos(turned) + y * np.sin(turned)
        down = -(z * np.cos(raised) + (y * np.cos(turned) - x * np.sin(turned)) * np.sin(raised))
        places = " ".join(f"{a:.5g},{b:.5g}" for a, b in zip(across, down, strict=True))
        kind = f"q{names.index(name) % 4}" if name else "fixed"
        width = far * 2.2 / 100 * (1.8 if name else 0.7)
        drawn.append(
            f'<polyline class="{kind}" points="{places}" fill="none" stroke-width="{width:.4g}"'
            ' stroke-linecap="round" stroke-linejoin="round"/>'
        )
    return f"{-1.1 * far:.4g} {-1.15 * high:.4g} {2.2 * far:.4g} {2.3 * high:.4g}", "".join(drawn)


def page_source(name: str) -> str:
    """A script or a style of this room."""
    return files("upright.live").joinpath(name).read_text(encoding="utf-8")


def source_hash(text: str) -> str:
    """A source expression of a content-security policy that allows exactly this text."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
