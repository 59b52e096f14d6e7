"""Does the picture above a benchmark's table say what the table says?"""

from __future__ import annotations

from pathlib import Path

import pytest

from docs.dot_plots import SHOWN, Cell, Shown, rows, with_picture

PAGES = Path(__file__).parent.parent / "benchmarks"
PAGE = """# Kept

| logs | what is kept |
|---|---|
| all | 298 of 300 keep nine tenths (99 %); least 88 % |
| none of these | left out |
| driven | 60 of 60 keep nine tenths (100 %); least 96 % |

| another | table |
|---|---|
| all | (12 %) |
"""


def test_a_dot_is_the_number_of_its_row_and_rows_without_one_have_none():
    drawn = rows(PAGE, SHOWN["kept"])
    assert [(row.name, row.measured[""]) for row in drawn] == [
        ("all", [(99.0, 99.0, 99.0)]),
        ("driven", [(100.0, 100.0, 100.0)]),
    ]


def test_numbers_of_several_cells_have_names_ranges_bounds_and_shares():
    shown = Shown(
        label="ms",
        series={"most": Cell(pattern=r"([\d.]+) \(([\d.]+) to ([\d.]+)\)"), "least": Cell(at=2)},
        targets={"bound": Cell(at=1), "all": 5.0},
        named=2,
    )
    (row,) = rows("| a | b | c | d | e |\n|--|--|--:|--:|:-:|\n| x | y | 3 (1 to 4.5) | 7 | 0.5 |\n", shown)
    assert row.name == "x, y"
    assert row.measured == {"most": [(3.0, 1.0, 4.5)], "least": [(0.5, 0.5, 0.5)]}
    assert row.targets == {"bound": 7.0, "all": 5.0}
    share = Shown(label="%", series={"": Cell(pattern=r"(\d+) of")}, of=Cell(pattern=r"of (\d+)"))
    (row,) = rows("| a | b |\n|--|--|\n| x | 3 of 4 |\n", share)
    assert row.measured[""] == [(75.0, 75.0, 75.0)]


def test_rows_of_a_kind_are_one_and_a_row_of_two_tables_has_the_dots_of_both():
    page = "| a | b |\n|--|--:|\n| x 1 | 3 |\n| y 2 | 4 |\n| x 3 | 5 |\n\n| a | b |\n|--|--:|\n| x 1 | 6 |\n"
    kinds = Shown(
        label="%", series={"even": Cell(where="[46]$"), "odd": Cell(where="[35]$")}, kinds=(("y", "Y"), ("x", "X"))
    )
    assert [(row.name, row.measured) for row in rows(page, kinds)] == [
        ("Y", {"even": [(4.0, 4.0, 4.0)], "odd": []}),
        ("X", {"even": [], "odd": [(3.0, 3.0, 3.0), (5.0, 5.0, 5.0)]}),
    ]
    both = rows(page, Shown(label="%", series={"first": Cell(), "second": Cell(table=1)}))
    assert [row.name for row in both] == ["x 1", "y 2", "x 3"]
    assert both[0].measured == {"first": [(3.0, 3.0, 3.0)], "second": [(6.0, 6.0, 6.0)]}


def test_the_page_stays_as_it_is_but_for_the_picture_above_its_first_table(tmp_path):
    page = with_picture("kept", PAGE, tmp_path / "pictures")
    (picture,) = (line for line in page.split("\n") if line.startswith("!["))
    assert page.replace(picture + "\n\n", "") == PAGE
    assert page.index(picture) < page.index("| logs |")
    assert "2 rows" in picture
    drawn = (tmp_path / "pictures" / "kept.svg").read_text(encoding="utf-8")
    assert all(name in drawn for name in ("driven", "target: 95", "what moves are kept [%]"))
    assert with_picture("soak of another kind", PAGE, tmp_path) == PAGE


@pytest.mark.parametrize("name", SHOWN)
def test_every_page_that_is_to_have_a_picture_has_rows_for_it(name):
    """A table that is worded anew would lose its dots without a word."""
    page = (PAGES / f"{name}.md").read_text(encoding="utf-8")
    drawn = rows(page, SHOWN[name])
    table = page[page.index("\n|") + 1 :].split("\n\n")[0].split("\n")[2:]
    dots = sum(max(map(len, row.measured.values())) for row in drawn)
    assert dots >= 0.35 * len([line for line in table if line.startswith("|")])
    assert {s for row in drawn for s, numbers in row.measured.items() if numbers} == set(SHOWN[name].series)
