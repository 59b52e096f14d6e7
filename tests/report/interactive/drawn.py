"""What a drawn chart shows, read back from its SVG alone."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np

_NUMBER = r"-?\d+(?:\.\d+)?"


def drawings(markup):
    """The drawings of a chart by their kind, as trees."""
    return {svg.get("class"): svg for svg in ElementTree.fromstring(markup).iter("svg")}


def panels(svg):
    """Axes of every panel in the drawing's units, with what is drawn in it: left, top, width, height, element."""
    found = [g for g in svg.iter("g") if g.get("class") == "panel"]
    return [(*map(float, g.get("data-area").split()), g) for g in found]


def values(chart, i, x, y):
    """Places in the drawing as values on the axes of panel i of its wide drawing."""
    left, top, wide, high, _ = panels(drawings(chart.svg("a"))["wide"])[i]
    shares = (np.asarray(x) - left) / wide, 1 - (np.asarray(y) - top) / high
    spans = ((chart.span, chart.logarithmic), (chart.spans[i], chart.panels[i].logarithmic))
    return [
        low * (high / low) ** s if log else low + s * (high - low)
        for s, ((low, high), log) in zip(shares, spans, strict=True)
    ]


def curve(chart, i, colour):
    """Values along the longest path of a colour in panel i."""
    *_, panel = panels(drawings(chart.svg("a"))["wide"])[i]
    paths = [p.get("d") for p in panel.iter("path") if colour in (p.get("stroke") or "")]
    places = np.array(re.findall(rf"({_NUMBER}) ({_NUMBER})", max(paths, key=len)), dtype=float)
    return values(chart, i, *places.T)


def circles(chart, i, colour):
    """Values at the circles of a colour in panel i."""
    *_, panel = panels(drawings(chart.svg("a"))["wide"])[i]
    places = [(float(c.get("cx")), float(c.get("cy"))) for c in panel.iter("circle") if colour in c.get("stroke")]
    return np.array(values(chart, i, *np.array(places).T)).T
