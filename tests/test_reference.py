"""Do the reference pages show every command, every option and every public name, and do their examples run?"""

from __future__ import annotations

import math
import re
import runpy
import shutil
from pathlib import Path

import pytest

import upright as up
from docs import moving_picture, reference
from upright.cli import DECLARED
from upright.cli.build import build

ROOT = Path(__file__).parents[1]


def test_every_public_name_has_an_example_that_uses_it():
    cells = reference.examples()
    assert set(cells) == {"set-up", *up.__all__}
    for name in up.__all__:
        assert re.search(rf"\b{name}\b", cells[name]), f"the example of {name} does not show it"


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("avr-gcc"), reason="builds an image, and needs avr-gcc and avr-libc")
def test_the_examples_of_the_reference_run_from_top_to_bottom(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    session = runpy.run_path(str(reference.SESSION))
    truth, estimates = session["arm"], session["fit"].parameters
    for name in ("J_d", "J_p", "b_1c"):
        assert estimates.low[name] <= getattr(truth, name) <= estimates.high[name]


def test_every_name_stands_in_one_section_of_the_index():
    named = [name for names in reference.groups().values() for name in names]
    assert sorted(named) == sorted(up.__all__)


@pytest.mark.parametrize("words", DECLARED)
def test_a_page_has_every_option_of_its_command(words):
    page = reference.command_page(DECLARED[words])
    for parameter in build(DECLARED[words]).params:
        if parameter.param_type_name == "option" and parameter.name != "help":
            assert all(f"`{option}" in page for option in parameter.opts), parameter.opts


def test_the_moving_picture_draws_a_rod_that_keeps_its_length():
    """In space; on the page it is foreshortened by at most the tilt of the view."""
    svg = (ROOT / "docs" / "images" / "twin.svg").read_text(encoding="utf-8")
    assert len(svg) < 200_000
    rods = re.findall(r'<polyline[^>]*stroke="#D55E00" stroke-width="6"[^>]*><animate[^>]* values="([^"]+)"', svg)
    assert len(rods) == 1
    lengths = []
    for frame in rods[0].split(";"):
        (x0, y0), (x1, y1) = (map(float, point.split(",")) for point in frame.split())
        lengths.append(math.hypot(x1 - x0, y1 - y0))
    whole = (
        moving_picture.SCALE * 2 * 0.183635
    )  # twice l_cg of the rig with seed 1, as the report of the swing-up lists it
    assert max(lengths) <= whole + 0.2  # points are rounded to 0.1
    assert lengths[-1] == pytest.approx(whole * math.cos(moving_picture.ELEVATION), abs=0.3)  # upright at last
    assert lengths[0] == pytest.approx(lengths[-1], abs=0.3)  # hanging at first
