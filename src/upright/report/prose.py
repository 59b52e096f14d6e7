"""A chapter's words: a Markdown template beside the code that computes its numbers, and the pictures that it places.

A template is Jinja's over Markdown as far as a chapter has it::

    # Title

    > Question

    Verdict, the first paragraph.

    Detail, the others.

    ## Part {key folded}

    A paragraph.

    - points

    | | column | number | state |
    |---|---|--:|:-:|
    | *k_1* [N/m] | text | 1.0 | kept |
    : caption

    ![what it shows, for who cannot see it](name) caption

    [name]

    ## Next

    - What to do. `command`
    - What to write.
      ```
      lines
      ```

``*name* [unit]`` in a cell is a `Symbol`, a column in the middle (``:-:``) holds badges; ``![...](name)`` draws a
picture or a chart, ``[name]`` sets blocks and ``## [name]`` whole parts that the code hands over. A part's key, and
whether it is folded or an aside, may be left out.
A name that the template misspells is an error.
"""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

from upright.basis import in_percent
from upright.report.interactive.charts import Readable
from upright.report.page import Block, Chapter, Code, Part, Picture, Points, Step, Symbol, Table
from upright.report.symbols import number, percent, plain, typed, unit

if TYPE_CHECKING:
    from jinja2 import Environment

_NOTHING = "\0"
"""Printed where an expression comes to nothing, so that a line of it alone parts no paragraph."""
_PARAGRAPH = re.compile(r"\n\s*\n")
_BLANK = re.compile(r"[ \n]+")
_SYMBOL = re.compile(r"\*([^*]+)\*(.*)", re.S)
_CELL = re.compile(r"(?<!\\)\|")
_PICTURE = re.compile(r"!\[(.*?)\]\(([\w-]+)\)\s*(.*)", re.S)
_PLACED = re.compile(r"\[(\w+)\]")
_PART = re.compile(r"(.*?)(?: \{(?:(?!folded|aside)(\w+))? ?(folded|aside)?\})?")
_STEP = re.compile(r"(.*?)(?: `(.*)`)?", re.S)

Placed = Mapping[str, Sequence[Block | Part]]
Figures = Mapping[str, Callable[[], Any] | tuple[Callable[[], Any], Callable[[], str]] | Readable | None]


def chapter_of(
    module: str, *, template: str = "", figures: Figures | None = None,
    placed: Placed | None = None, **values: Any,
) -> Chapter:  # fmt: skip
    """The template beside a module as a chapter: title, question, verdict, detail, parts and what to do next.

    Parameters
    ----------
    module : str
        Its ``__name__``.
    template : str
        Name of the template without its ending; the module's own when empty.
    figures : mapping of str to callable, two callables or Readable, optional
        Each picture that the template places: what draws it, and what answers on a screen; or a chart.
    placed : mapping of str to sequence of Block or Part, optional
        What the template sets by ``[name]`` and ``## [name]``.
    **values
        What the template computes its sentences from.

    Raises
    ------
    jinja2.UndefinedError
        When the template names what there is not.
    KeyError
        When it places a picture or a block that was not handed over.
    """
    package, _, own = module.rpartition(".")
    text = templates_of(package).get_template(f"{template or own}.md").render(**values)
    head, *sections = re.split(r"^## ", text, flags=re.M)
    title, question, texts = "", "", list[str]()
    for paragraph in _paragraphs(head):
        if paragraph.startswith("# "):
            title = _line(paragraph[2:])
        elif paragraph.startswith("> "):
            question = _line(paragraph[2:].replace("\n>", "\n"))
        else:
            texts.append(_line(paragraph))
    parts, steps = list[Part](), tuple[Step, ...]()
    for section in sections:
        heading, _, body = section.partition("\n")
        heading = heading.replace(_NOTHING, "")
        if heading.strip() == "Next":
            steps = tuple(map(_step, _listed(body.replace(_NOTHING, ""))))
        elif named := _PLACED.fullmatch(heading.strip()):
            parts += [p for p in (placed or {})[named[1]] if isinstance(p, Part)]
        else:
            parts.append(_part(heading.strip(), body, figures or {}, placed or {}))
    return Chapter(
        title=title, question=question, verdict=texts[0] if texts else "", detail=" ".join(texts[1:]),
        parts=tuple(p for p in parts if p.content), steps=steps,
    )  # fmt: skip


@cache
def templates_of(package: str) -> Environment:
    """The templates beside the modules of a package, with the program's ways to write numbers as filters."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    templates: Any = Environment(  # its stubs know only its own filters and tests
        loader=PackageLoader(package, "."), undefined=StrictUndefined, finalize=_cell, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    templates.filters.update({
        "number": number, "percent": percent, "symbol": plain, "typed": typed, "unit": unit, "fmt": format,
        "degrees": math.degrees, "in_percent": in_percent, "parameter": Symbol, "sentence": _sentence,
        "capital": lambda text: f"{text[:1].upper()}{text[1:]}",
    })  # fmt: skip
    templates.tests.update({"finite": math.isfinite})
    return templates


def _sentence(clause: str) -> str:
    """A clause with a capital letter and a full stop."""
    return f"{clause[:1].upper()}{clause[1:]}{'' if clause[-1:] in '.!?' else '.'}"


def _cell(value: Any) -> Any:
    """A value as it stands in Markdown, where bars would part cells and blank lines paragraphs; ``| safe`` may."""
    from markupsafe import Markup

    if isinstance(value, Symbol):
        name, rest = value.divided()
        return f"*{name}*{rest}"
    if isinstance(value, str) and not isinstance(value, Markup):
        value = _BLANK.sub(" ", value.replace("|", r"\|"))
    return value if str(value) else _NOTHING


def _line(text: str) -> str:
    """A text on one line, its bars as they were."""
    return _BLANK.sub(" ", text).strip().replace(r"\|", "|")


def _paragraphs(text: str) -> list[str]:
    paragraphs = (p.replace(_NOTHING, "").strip() for p in _PARAGRAPH.split(text))
    return [p for p in paragraphs if p]


def _listed(text: str) -> list[str]:
    """The points of a list, as they stand there."""
    return [item for item in re.split(r"^- ", text, flags=re.M) if item.strip()]


def _items(text: str) -> list[str]:
    """The points of a list, each on a line."""
    return [_line(item) for item in _listed(text)]


def _step(text: str) -> Step:
    sentence, fence, lines = text.partition("\n  ```\n")
    if fence:
        return Step(_line(sentence), textwrap.dedent(lines.rpartition("  ```")[0]).strip().replace(r"\|", "|"))
    match = _STEP.fullmatch(_line(text))
    assert match is not None  # as anything is a sentence
    return Step(match[1], match[2] or "")


def _part(heading: str, body: str, figures: Figures, placed: Placed) -> Part:
    match = _PART.fullmatch(heading)
    assert match is not None
    content: list[Block] = []
    for paragraph in _paragraphs(body):
        named = _PLACED.fullmatch(paragraph)
        new = placed[named[1]] if named else (_block(paragraph, figures),)
        content += [b for b in new if not isinstance(b, Part)]
    how = match[3]
    return Part(match[1], tuple(content), key=match[2] or "", folded=how == "folded", aside=how == "aside")


def _block(text: str, figures: Figures) -> Block:
    if "\n![" in text:  # of the template's own, as values stand on one line
        raise ValueError(f"a picture needs a blank line before it: {text}")
    if text.startswith("|"):
        return _table(text)
    if text.startswith("- "):
        return Points(tuple(_items(text)))
    if text.startswith("```"):
        return Code(text.strip("`\n"))
    if match := _PICTURE.fullmatch(text):
        name, caption, description = match[2], _line(match[3]), _line(match[1])
        drawn = figures[name]
        assert drawn is not None, f"{name} is placed and not drawn"
        if isinstance(drawn, Readable):
            return drawn.picture(name, caption=caption, description=description)
        draw, answers = drawn if isinstance(drawn, tuple) else (drawn, "")
        return Picture(name=name, draw=draw, interactive=answers, caption=caption, description=description)
    return _line(text)


def _table(text: str) -> Table:
    rows, _, caption = text.partition("\n: ")
    headings, rule, *cells = (_cells(row) for row in rows.splitlines() if row.strip())
    for row in cells:
        if len(row) != len(headings):
            raise ValueError(f"a row of {len(row)} cells in a table of {len(headings)} columns: {' | '.join(row)}")
    badges = [i for i, r in enumerate(rule) if r.startswith(":")]
    return Table(
        caption=_line(caption), headings=headings, rows=tuple(cells), badge=badges[0] if badges else None,
        numbers=tuple(i for i, r in enumerate(rule) if r.endswith(":") and i not in badges),
    )  # fmt: skip


def _cells(row: str) -> tuple[str, ...]:
    cells = (_line(c) for c in _CELL.split(row.strip())[1:-1])
    return tuple(Symbol(m[1] + m[2]) if (m := _SYMBOL.fullmatch(c)) else c for c in cells)
