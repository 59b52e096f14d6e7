"""Does a terminal show tables, points and steps in their order, and lose words before numbers?"""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console

from upright.report.page import (
    Book,
    Chapter,
    Code,
    Facts,
    KeyNumber,
    Part,
    Points,
    Step,
    Symbol,
    Table,
    as_plain,
    from_plain,
)
from upright.report.terminal import print_book, print_chapter, print_steps


def printed(what, *more, width=80, **named):
    stream = io.StringIO()
    what(Console(file=stream, width=width), *more, **named)
    return [line.rstrip() for line in stream.getvalue().splitlines()]


def test_what_stands_among_the_points_is_not_said_again_in_the_verdict():
    page = Chapter(
        title="T", verdict="It holds.", detail="Just so. m = 1 is assumed. Weigh it. No more.",
        parts=(Part("Assumed", (Points(("m = 1 is assumed. Weigh it.", "so")),)),),
    )  # fmt: skip
    *_, verdict = printed(print_chapter, page)
    assert verdict == "Verdict: It holds. Just so. No more."


WIDE = Table(caption="Numbers", headings=("name", "size", "remark"), numbers=(1,),
             rows=(("arm", "1.5", "it moves"), ("rod", "22", "")))  # fmt: skip


def test_a_chapter_is_told_part_by_part_and_its_verdict_last():
    page = Chapter(
        title="T", verdict="It holds.", detail="Just so.", warnings=("The base leans.",), first_line="Simulated.",
        parts=(Part("One", ("prose", Points(("a [b]",)), WIDE, Facts((("x", "1"),)))),
               Part("Hidden", (Points(("h",)),), aside=True),
               Part("Prose", ("nothing else",)), Part("Two", (WIDE, Code("do\nthis")))),
        steps=(Step("Look."), Step("Run it.", "upright run\nagain")),
    )  # fmt: skip
    table = ["Numbers", "name  size  remark", "arm    1.5  it moves", "rod     22"]
    assert printed(print_chapter, page, [Path("a.html"), Path("b.pdf")], "Title") == [
        "Simulated.", "Title", "", "One", "- a [b]", "", *table, "- x: 1", "", "Two", *table, "    do", "    this", "",
        "Verdict: It holds. Just so.", "Warning: The base leans.", "", "Written: a.html, b.pdf", "What next:",
        "- Look.", "- Run it.", "    upright run", "    again",
    ]  # fmt: skip
    bare = Chapter(title="T", verdict="")
    assert printed(print_chapter, bare) == []


LONG = Table(caption="C", headings=("name", "12345678", "meaning of all this"),
             rows=(("a name of twenty-one", "1.5", "words and more words"),), numbers=(1,))  # fmt: skip


@pytest.mark.parametrize(("width", "shown"), [(42, True), (41, False)])
def test_the_last_column_of_words_is_left_out_where_it_would_be_too_narrow(width, shown):
    """14 characters for each column of words, 8 for the numbers, 2 between: 42 in all."""
    page = Chapter(title="T", verdict="", parts=(Part("P", (LONG,)),))
    text = "".join("".join(printed(print_chapter, page, width=width)).split())
    assert ("words" in text) == shown
    assert "1.5" in text
    numbers = Table(caption="C", headings=LONG.headings, rows=LONG.rows, numbers=(1, 2))
    kept = Chapter(title="T", verdict="", parts=(Part("P", (numbers,)),))
    assert any("meaning" in line for line in printed(print_chapter, kept, width=width))


def test_a_book_tells_every_chapter_in_short_and_what_is_missing():
    one = Chapter(title="Swing", verdict="V.", detail="D.", key="4", about="twin", first_line="Simulated.",
                  findings=(KeyNumber(what="J", value="2", interval="1 to 3", truth="2.5"),
                            KeyNumber(what="b", value="7")))  # fmt: skip
    book = Book(title="B", facts=(), chapters=(one,), notes=("Interrupted.",), missing=(("3", "Tracking"),),
                steps=(Step("Read."),))  # fmt: skip
    assert printed(print_book, book, [Path("r.html")]) == [
        "Experiment 4, Swing (twin)", "    Simulated.", "    V. D.", "    J: 2, 95 % interval 1 to 3; truth 2.5",
        "    b: 7", "Experiment 3, Tracking: not run", "", "Interrupted.", "", "Report: r.html", "What next:",
        "- Read.",
    ]  # fmt: skip
    assert printed(print_steps, ()) == []


def chapter(key, *found, **more):
    return Chapter(title=f"T{key}", verdict=f"V{key}", key=key, about=f"rig {key}", findings=found, **more)


def test_the_cover_shows_verdicts_and_numbers_of_their_own_chapters():
    J = KeyNumber(what="J", value="2", interval="1 to 3", truth="2.5")
    book = Book(title="B", facts=(("when", "now"),), missing=(("3", "Tracking"),),
                chapters=(chapter("1", J), chapter("2", sound=False), chapter("4", finished=False)))  # fmt: skip
    facts, glance, found = book.cover
    assert facts.content[0].pairs == (("when", "now"),)
    table = glance.content[0]
    assert table.rows == (
        ("1", "T1", "rig 1", "V1", "supported"), ("2", "T2", "rig 2", "V2", "with reservations"),
        ("4", "T4", "rig 4", "V4", "not finished"), ("3", "Tracking", "", "", "not run"),
    )  # fmt: skip
    assert table.headings[table.badge] == "state"
    assert table.anchors == ("experiment-1", "experiment-2", "experiment-4")
    assert "true values" in glance.content[1]
    numbers = found.content[0]
    assert (numbers.headings[-1], numbers.rows) == ("truth", (("1", "J", "2", "1 to 3", "2.5"),))
    assert (numbers.numbers, numbers.anchors) == ((2, 3, 4), ("experiment-1",))
    real = Book(title="B", facts=(), chapters=(chapter("1", KeyNumber(what="J", value="2", interval="1 to 3")),))
    _, glance, found = real.cover
    assert "true values" not in glance.content[1]
    assert found.content[0].headings == ("from", "quantity", "value", "95 % interval")
    assert (found.content[0].rows, found.content[0].numbers) == ((("1", "J", "2", "1 to 3"),), (2, 3))
    assert len(Book(title="B", facts=(), chapters=(chapter("1"),)).cover) == 2


def test_a_chapter_survives_as_plain_values_symbols_and_numbers_included():
    table = Table(caption="C", headings=("a",), rows=((Symbol("J_d [kg]"),),), numbers=(0,), badge=0)
    page = Chapter(title="T", verdict="V", parts=(Part("P", (table, Points(("x",))), "key"),), numbers={"a": [1, 2]},
                   steps=(Step("s", "c"),))  # fmt: skip
    again = from_plain(as_plain(page))
    assert again.parts == page.parts
    assert type(again.parts[0].content[0].rows[0][0]) is Symbol
    assert again.numbers == {"a": [1, 2]}
    assert (again.title, again.steps, again.sound) == ("T", page.steps, True)
    assert Symbol("J_d [kg]").divided() == ("J_d", " [kg]")


STATUSES = Table(
    caption="Numbers", headings=("symbol", "value", "status", "name and meaning"), numbers=(1,),
    rows=(("actuator.gain", "0.1609", "well determined (±6.4 %)", "force per unit of command"),),
)  # fmt: skip


@pytest.mark.parametrize("width", range(30, 101, 5))
def test_a_table_breaks_no_word_however_narrow_the_terminal_is(width):
    page = Chapter(title="T", verdict="", parts=(Part("One", (STATUSES,)),))
    lines = printed(print_chapter, page, width=width)
    words = " ".join(lines).split()
    for cell in STATUSES.rows[0][:-1]:  # the last column is left out before the others suffer
        assert all(word in words for word in cell.split()), lines
    assert max(map(len, lines)) <= width


def test_sentences_wrap_at_words_where_somebody_watches_and_commands_stay_whole():
    stream = io.StringIO()
    verdict = "A sentence of many words that a terminal of forty columns would break in the middle of one."
    command = "upright identify a-study-with-a-long-name.toml -o a-folder-with-a-long-name"
    page = Chapter(title="T", verdict=verdict, steps=(Step(verdict, command),))
    print_chapter(Console(file=stream, width=40, force_terminal=True, color_system=None), page)
    lines = stream.getvalue().splitlines()
    assert f"    {command}" in lines
    prose = [line for line in lines if command not in line]
    assert max(map(len, prose)) <= 40
    assert verdict in " ".join(" ".join(prose).split())
    assert f"Verdict: {verdict}" in printed(print_chapter, page, width=40)  # piped: a line of its own
