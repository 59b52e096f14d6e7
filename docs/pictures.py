"""What a figure looks like in a stored notebook: few colours, and words for who cannot see it.

An extension of IPython, which `docs.notebook` loads before the first cell (``%load_ext docs.pictures`` does it by hand).
"""

from __future__ import annotations

import io
import re
from typing import Any

WIDTH = 720  # pixels of a picture on the page
_SHARP = 1.25  # stored pixels to one on the page
_COLOURS = 80
LIVE = "<p><em>Run this cell: the rig moves here, and you can push it.</em></p>"
"""What is stored of a page in which a rig moves, whose program is larger than a notebook may be."""
_COLUMN = 7.4  # inches, as wide as figures are drawn


def load_ipython_extension(shell: Any) -> None:
    """Store every figure as a small PNG with its description."""
    import matplotlib_inline.backend_inline  # noqa: F401, sets its own way to show a figure, once
    from matplotlib.figure import Figure

    formatters = shell.display_formatter.formatters
    formatters["image/png"].for_type(Figure, _png)
    formatters["text/plain"].for_type(
        Figure, lambda drawing, printer, _: printer.text(description(drawing))
    )
    for moving in ("Played", "PlayedRun"):
        formatters["text/html"].for_type_by_name(
            "upright.verbs.control.moving", moving, lambda _: LIVE
        )


def _png(drawing: Any) -> tuple[bytes, dict[str, Any]]:
    """Picture in few colours, which is all that curves and labels need; its description and its width on the page."""
    from PIL import Image

    raw, small = io.BytesIO(), io.BytesIO()
    drawing.savefig(raw, format="png", dpi=_SHARP * WIDTH / _COLUMN, facecolor="white")
    few = Image.open(raw).convert("RGB")
    few = few.quantize(_COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(small, format="png", optimize=True)
    width = round(WIDTH * min(1.0, drawing.get_figwidth() / _COLUMN))
    return small.getvalue(), {"alt": description(drawing), "width": width}


def description(drawing: Any) -> str:
    """What a picture shows, in words: titles, and what is drawn over what."""
    panels: list[str] = []
    for axes in drawing.axes:
        titles = (axes.get_title(loc) for loc in ("left", "center", "right"))
        labels = (axes.get_ylabel(), axes.get_xlabel()) if axes.axison else ()
        panels.append(
            ": ".join(
                filter(None, (", ".join(filter(None, titles)), " over ".join(filter(None, labels))))
            )
        )
    words = "; ".join(dict.fromkeys(filter(None, panels))) or "a drawing"
    return "Picture. " + " ".join(re.sub(r"\\math\w+|[${}\\]", "", words).split())
