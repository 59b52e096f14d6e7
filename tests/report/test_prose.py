"""Does a template say exactly what stands in it, and is a slip in it an error rather than a gap?"""

import sys

import jinja2
import numpy as np
import pytest

from upright.report.interactive.charts import Chart, ChartLine, ChartPanel
from upright.report.page import Code, Picture, Points, Step, Symbol, Table
from upright.report.prose import chapter_of

TEXT = """\
# A {{ word }}

> Why a
> {{ word }}?

The verdict of {{ value | number(3) }} is
on two lines.

What it rests on.

## Numbers {folded}

| symbol | value | state |
|---|--:|:-:|
{% for name in names %}
| {{ name | parameter }} | {{ value }} | kept |
{% endfor %}
: A caption
on two lines.

- one
- two,
  on two lines

![A line that rises.](line) As measured.

[extra]

```
upright show
```

## Next

- Look at it. `upright show a.csv`
- Think.
"""


def test_a_chart_is_placed_as_one_that_answers_a_cursor(module):
    line = ChartLine(name="", x=np.arange(2.0), y=np.arange(2.0))
    chart = Chart(x="time", unit="s", panels=(ChartPanel(title="x", unit="m", lines=(line,)),))
    page = chapter_of(
        module("# T\n\nV.\n\n## P\n\n![It rises.](line) As\nmeasured.\n", "prose_chart"), figures={"line": chart}
    )
    (picture,) = page.parts[0].content
    assert (picture.kind, picture.name) == ("chart", "line")
    assert (picture.caption, picture.description) == ("As measured.", "It rises.")


@pytest.fixture
def module(tmp_path, monkeypatch):
    """A package with a template, on the path as an installed one is."""

    def made(text: str, name: str) -> str:
        folder = tmp_path / name
        folder.mkdir()
        (folder / "__init__.py").touch()
        (folder / "chapter.md").write_text(text, encoding="utf-8")
        monkeypatch.syspath_prepend(str(tmp_path))
        return f"{name}.chapter"

    yield made
    for name in [n for n in sys.modules if n.startswith("prose_")]:
        del sys.modules[name]


def test_a_template_becomes_the_chapter_that_it_reads_as(module):
    page = chapter_of(
        module(TEXT, "prose_whole"), word="pole", value=3.14159, names=("J_d [kg m²]",),
        figures={"line": lambda: "drawn"}, placed={"extra": ("A sentence of the code's.",)},
    )  # fmt: skip
    assert (page.title, page.question) == ("A pole", "Why a pole?")
    assert (page.verdict, page.detail) == ("The verdict of 3.14 is on two lines.", "What it rests on.")
    assert page.steps == (Step("Look at it.", "upright show a.csv"), Step("Think."))
    (part,) = page.parts
    assert (part.title, part.folded, part.aside) == ("Numbers", True, False)
    table, points, picture, extra, code = part.content
    assert table == Table(
        caption="A caption on two lines.", headings=("symbol", "value", "state"), numbers=(1,), badge=2,
        rows=(("J_d [kg m²]", "3.14159", "kept"),),
    )  # fmt: skip
    assert isinstance(table.rows[0][0], Symbol)
    assert points == Points(("one", "two, on two lines"))
    assert isinstance(picture, Picture)
    assert (picture.name, picture.caption, picture.description) == ("line", "As measured.", "A line that rises.")
    assert picture.draw() == "drawn"
    assert (extra, code) == ("A sentence of the code's.", Code("upright show"))


def test_a_bar_and_a_blank_line_in_a_value_part_nothing(module):
    text = "# T\n\n{{ said }}\n\n## P\n\n| a |\n|---|\n| {{ said }} |\n"
    page = chapter_of(module(text, "prose_bar"), said="|x|\n\n## no part")
    assert page.verdict == "|x| ## no part"
    assert page.parts[0].content[0].rows == (("|x| ## no part",),)


def test_a_part_has_its_key_and_a_step_lines_to_write(module):
    text = (
        "# T\n\nV.\n\n## A {first}\n\na\n\n## B {second folded}\n\n![i](drawn) c\n\n## C {aside}\n\nc\n\n## Next\n\n"
        '- Write it\n  down.\n  ```\n  [runs]\n  label = "{{ said }}"\n\n  upright show\n  ```\n- Look. `upright log`\n'
    )
    page = chapter_of(module(text, "prose_keys"), said="a|b", figures={"drawn": (lambda: "paper", lambda: "screen")})
    assert [(p.title, p.key, p.folded, p.aside) for p in page.parts] == [
        ("A", "first", False, False), ("B", "second", True, False), ("C", "", False, True),
    ]  # fmt: skip
    (picture,) = page.parts[1].content
    assert (picture.draw(), picture.answers) == ("paper", "screen")
    assert page.steps == (
        Step("Write it down.", '[runs]\nlabel = "a|b"\n\nupright show'), Step("Look.", "upright log"),
    )  # fmt: skip


def test_an_expression_that_prints_nothing_parts_no_paragraph(module):
    text = (
        "# T{{ '' }}\n\nOne\n{{ 'never' if not yes }}\n{{ '' }}\ntwo.\n\n## P{{ '' }}\n\n"
        "| a | b |\n|---|---|\n{{ '' }}\n| 1 | {{ '' }} |\n"
    )
    page = chapter_of(module(text, "prose_nothing"), yes=True)
    assert (page.title, page.verdict, page.detail) == ("T", "One two.", "")
    assert (page.parts[0].title, page.parts[0].content[0].rows) == ("P", (("1", ""),))


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        ("# T\n\n{{ valu }}\n", jinja2.UndefinedError, "valu"),
        ("# T\n\n{{ value.nothing }}\n", jinja2.UndefinedError, "nothing"),
        ("# T\n\n## P\n\n[nothing]\n", KeyError, "nothing"),
        ("# T\n\n## P\n\n![it](nothing) caption\n", KeyError, "nothing"),
        ("# T\n\n## P\n\nText\n![it](nothing) caption\n", ValueError, "blank line before"),
        ("# T\n\n## P\n\n| a | b |\n|---|---|\n| 1 |\n", ValueError, "1 cells in a table of 2"),
    ],
)
def test_a_misspelt_name_is_an_error(module, request, text, error, words):
    name = f"prose_{abs(hash(text))}"
    with pytest.raises(error, match=words):
        chapter_of(module(text, name), value=1.0)
