"""Is what a picture says to be read: nothing cut off at its edge, no axis label on the numbers of its axis?"""

from __future__ import annotations

import math
import re
from itertools import combinations

from matplotlib.axis import Tick
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from matplotlib.textpath import TextPath

from tests.report.interactive.drawn import drawings
from upright.report.interactive.charts import Readable

PIXEL = 1.0


def unreadable(drawing) -> list[str]:
    """Texts that the edge cuts off, and those outside of the frames that lie on one another."""
    if isinstance(drawing, Readable):
        return [text for svg in drawings(drawing.svg("a")).values() for text in _unreadable_in(svg)]
    FigureCanvasAgg(drawing).draw()
    width, height = drawing.bbox.width, drawing.bbox.height
    texts = [text for text in drawing.findobj(Text) if text.get_visible() and text.get_text().strip()]
    of_ticks = {label for tick in drawing.findobj(Tick) for label in (tick.label1, tick.label2)}
    hidden = {text for ax in drawing.axes if not ax.get_visible() for text in ax.findobj(Text)}
    drawn = {label for ax in drawing.axes for label in _tick_labels(ax)} - hidden
    boxes = {text: text.get_window_extent() for text in texts if text in drawn or text not in of_ticks | hidden}
    cut = [
        f"cut off: {text.get_text()}"
        for text, box in boxes.items()
        if box.x0 < -PIXEL or box.y0 < -PIXEL or box.x1 > width + PIXEL or box.y1 > height + PIXEL
    ]
    outside = [text for text in boxes if text.axes is None or text not in text.axes.texts]
    labels = [(label, ax) for ax in drawing.axes for label in (ax.xaxis.label, ax.yaxis.label) if label in boxes]
    within = [
        f"in the frame: {label.get_text()}" for label, ax in labels if boxes[label].padded(-PIXEL).overlaps(ax.bbox)
    ]
    return (
        cut
        + within
        + [
            f"{one.get_text()} on {other.get_text()}"
            for one, other in combinations(outside, 2)
            if boxes[one].padded(-PIXEL).overlaps(boxes[other].padded(-PIXEL))
        ]
    )


def _tick_labels(ax) -> list[Text]:
    """Labels on the part of each axis that is drawn."""
    return [
        label
        for i, (axis, ends) in enumerate(((ax.xaxis, ax.get_xlim()), (ax.yaxis, ax.get_ylim())))
        for label in axis.get_ticklabels(which="both")
        if min(ends) <= label.get_position()[i] <= max(ends)
    ]


def _unreadable_in(svg) -> list[str]:
    """The same of a chart's drawing, in the widest letters that it is shown with."""
    wide = float(svg.get("viewBox").split()[2])
    above = {child: parent for parent in svg.iter() for child in parent}
    boxes: list[tuple[str, float, float, float]] = []
    for text in svg.iter("text"):
        words = "".join(text.itertext())
        pieces = [(t.text, float(t.get("font-size", svg.get("font-size")))) for t in text.iter() if t.text]
        long = sum(TextPath((0, 0), part, size=size).get_extents().width for part, size in pieces)
        anchor = text.get("text-anchor") or above[text].get("text-anchor", "start")
        turned = [float(part) for part in re.findall(r"-?[\d.]+", text.get("transform", ""))]
        x, y, angle = turned or (float(text.get("x")), float(text.get("y")), 0.0)
        share = {"start": 0.0, "middle": 0.5, "end": 1.0}[anchor] * math.cos(math.radians(angle))
        # of turned ones, which stand side by side, where they begin
        boxes.append((words, x - share * long, x - share * long + (0.0 if turned else long), y))
    cut = [f"cut off: {text}" for text, left, right, _ in boxes if left < -PIXEL or right > wide + PIXEL]
    return cut + [
        f"{a[0]} on {b[0]}" for a, b in combinations(boxes, 2) if a[1] < b[2] and b[1] < a[2] and abs(a[3] - b[3]) < 10
    ]
