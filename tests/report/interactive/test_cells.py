"""Are correlations coloured and written where their pair is, and readable on a phone and a desk?"""

from __future__ import annotations

import json
import math
import re

import numpy as np
import pytest

from tests.report.interactive.drawn import drawings, panels
from upright.report.interactive.cells import Cells

MATRIX = np.array([[1.0, 0.904, -0.31], [0.904, 1.0, math.nan], [-0.31, math.nan, 1.0]])
NAMES = ("m_p", "J_p", "theta_offset")


def drawn(kind="wide", matrix=MATRIX, names=NAMES):
    return drawings(Cells(names=names, matrix=matrix).svg("a"))[kind]


def many(n):
    return {"names": tuple(f"k_{i}" for i in range(n)), "matrix": np.full((n, n), 0.9) + 0.1 * np.eye(n)}


def cell(svg, x, y):
    """Row and column at a place of the drawing."""
    left, top, wide, high, _ = panels(svg)[0]
    return int((y - top) // (high / 3)), int((x - left) // (wide / 3))


def test_colour_tells_the_sign_and_its_strength_the_size():
    svg = drawn()
    seen = {}
    for path in panels(svg)[0][4].iter("path"):
        x, y = map(float, re.match(r"M([\d.]+) ([\d.]+)h", path.get("d")).groups())
        seen[cell(svg, x + 1, y + 1)] = ("--q0" in path.get("fill"), float(path.get("fill-opacity")))
    assert seen.keys() == {
        (0, 1),
        (1, 0),
        (0, 2),
        (2, 0),
    }  # what is not known has no colour, nor has a name with itself
    assert seen[0, 1] == seen[1, 0]
    assert [seen[at][0] for at in ((0, 1), (2, 0))] == [True, False]
    assert seen[0, 1][1] / seen[2, 0][1] == pytest.approx(0.904 / 0.31, rel=0.05)


def test_figures_stand_in_their_cells_and_strong_ones_are_bold():
    svg = drawn()
    written = {cell(svg, float(t.get("x")), float(t.get("y"))): (t.text, t.get("font-weight", ""))
               for t in svg.iter("text") if t.text}  # fmt: skip
    assert written == {
        (0, 0): ("1", ""), (1, 1): ("1", ""), (2, 2): ("1", ""), (0, 1): ("0.90", "700"), (1, 0): ("0.90", "700"),
        (0, 2): ("−0.31", ""), (2, 0): ("−0.31", ""), (1, 2): ("–", ""), (2, 1): ("–", ""),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("n", "kind", "figures"), [(3, "narrow", 2), (9, "narrow", 1), (12, "narrow", 0), (9, "wide", 2), (24, "wide", 0)]
)
def test_where_a_figure_has_no_room_there_is_none(n, kind, figures):
    """0.9 and its like take four characters of 7.4 units and some room; a row of a phone has 330 units."""
    texts = {t.text for t in drawn(kind, **many(n)).iter("text") if t.text}
    assert {len(t.partition(".")[2]) for t in texts if t != "1"} == ({figures} if figures else set())


@pytest.mark.parametrize(("names", "turned"), [(("m_p", "J_p", "b_1"), False), (many(24)["names"], True),
                                               ((*many(9)["names"][1:], "theta_offset"), True)])  # fmt: skip
def test_names_wider_than_their_cells_are_turned(names, turned):
    svg = drawn("narrow", names=names, matrix=np.eye(len(names)))
    assert [len([t for t in svg.iter("text") if t.get("transform")])] == [len(names) * turned]
    symbols = ["".join(t.itertext()) for t in svg.iter("text") if not t.text]
    assert symbols == [n.replace("theta", "θ").replace("_", "") for n in names] * 2


def test_every_number_is_there_for_the_cursor():
    (panel,) = json.loads(Cells(names=NAMES, matrix=MATRIX).values())["panels"]
    assert [line["notes"] for line in panel["lines"]] == [
        ["m_p: 1.000", "J_p: 0.904", "theta_offset: −0.310"],
        ["m_p: 0.904", "J_p: 1.000", "theta_offset: not known"],
        ["m_p: −0.310", "J_p: not known", "theta_offset: 1.000"],
    ]


def test_seven_parameters_take_less_than_twenty_kilobytes():
    """A picture for a desk and one for a phone took 54 kB, of a page that may have 600."""
    drawing = Cells(**many(7))
    assert len(drawing.svg("a")) + len(drawing.values()) < 20_000
