"""One term per thing: the words that docs/reference/glossary.md replaced do not come back into the source."""

from __future__ import annotations

import io
import json
import re
import statistics
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
FILES = sorted((ROOT / "src/upright").rglob("*.py"))

REPLACED = frozenset(
    {"told", "wish", "wishes", "asked", "found", "said", "seen", "foreseen", "abreast", "shaken", "worn", "quantum"}
    | {"lie", "lies", "lying"}
)
"""Words that name nothing: the name is the request, the estimate, the message, the prediction, ... that it is."""

STANDING = {"quantum", "command_quantum", "WORN", "lies", "LIE", "FileNotFoundError"}
"""Former public names, which warn for one version, and Python's own; this set only shrinks."""

ANYWHERE = re.compile(r"\b(told|wish(es|ed)?|abreast|shaken|quantum|foresees?)\b", re.IGNORECASE)
"""Words that stand in no text either: docstrings, comments and messages."""
QUOTED = {"laws/linear.py", "rig/rig.py"}
"""Files that name a former option."""


def words_of(name: str) -> set[str]:
    """Words of an identifier, in lower case."""
    return {w.lower() for w in re.split(r"_+|(?<=[a-z0-9])(?=[A-Z])", name)}


def names_in(text: str) -> set[str]:
    return {t.string for t in tokenize.generate_tokens(io.StringIO(text).readline) if t.type == tokenize.NAME}


def replaced_names() -> dict[str, list[str]]:
    """Identifiers with a replaced word, and the files where they stand."""
    out: dict[str, list[str]] = {}
    for path in FILES:
        for name in names_in(path.read_text(encoding="utf-8")):
            if words_of(name) & REPLACED:
                out.setdefault(name, []).append(path.name)
    return out


@pytest.mark.parametrize(
    ("name", "words"), [("find_quantum", {"find", "quantum"}), ("FileNotFoundError", {"file", "not", "found", "error"})]
)
def test_an_identifier_is_read_word_by_word(name, words):
    assert words_of(name) == words
    assert names_in(f"x = '{name}'  # {name}\n{name} = 1\n") == {"x", name}


def test_no_identifier_has_a_word_that_was_replaced():
    assert {n: where for n, where in replaced_names().items() if n not in STANDING} == {}


def test_a_name_that_is_gone_leaves_the_list_of_those_that_may_stand():
    assert replaced_names().keys() >= STANDING


def test_no_text_has_a_word_that_was_replaced():
    lines = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in FILES
        if path.relative_to(ROOT / "src/upright").as_posix() not in QUOTED
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if ANYWHERE.search(line)
    ]
    assert lines == []


def test_a_word_is_defined_once_and_none_by_the_words_that_it_replaced():
    rows = [
        line.split("|")[1:3]
        for line in (ROOT / "docs/reference/glossary.md").read_text(encoding="utf-8").splitlines()
        if line.startswith("| ")
    ]
    terms = [term.strip() for cell, _ in rows for term in cell.split(",") if cell.strip() != "term"]
    assert len(terms) == len(set(terms)) > 40
    assert all(meaning.strip().endswith(".") for cell, meaning in rows if cell.strip() != "term")
    assert not [meaning for _, meaning in rows if ANYWHERE.search(meaning)]


WRITTEN = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md")),
    *(p for pattern in ("*.md", "*.ipynb") for p in sorted((ROOT / "docs").rglob(pattern)) if "_build" not in p.parts),
]
TEMPLATES = sorted((ROOT / "src/upright").rglob("*.md"))
"""What reports say."""
DIALECT = re.compile(
    r"\b(told|wish(es|ed)?|abreast|shaken|quanta|quantum|foresees?|foreseen|fore(told|tells)|of the make|lying"
    r"|least cost|at hand|by heart|nobody (said|gave)|come after|e-folds|columns that lie)\b",
    re.IGNORECASE,
)
"""Terms that the glossary replaced."""


def prose(path: Path) -> str:
    """Sentences of a page, of a template or of a notebook's text: no code, tables, headings or formulas."""
    text = re.sub(r"\{%.*?%\}", "", path.read_text(encoding="utf-8"), flags=re.S)
    text = re.sub(r"\{\{.*?\}\}", "X", text, flags=re.S)
    if path.suffix == ".ipynb":
        cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "markdown"]
        text = "\n\n".join("".join(cell["source"]) for cell in cells)
    text = re.sub(r"```.*?```|\$\$.*?\$\$", "", text, flags=re.S)
    return re.sub(r"^(    .*|\s*\|.*|#.*|<.*>|:::.*)$", "", text, flags=re.M)


def sentence_lengths(text: str) -> list[int]:
    """Words of each sentence; code and formulas count as one, fragments of less than three words not at all."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"`[^`]*`|\$[^$]*\$", "X", text)
    lengths: list[int] = []
    for paragraph in re.split(r"\n\s*\n|\n(?=\s*(?:[*-]|\d+\.) )", text):
        for sentence in re.split(r"(?<=[.!?:])\s+(?=[A-Z*_(\"X])", " ".join(paragraph.split())):
            lengths.append(len(re.findall(r"[\w'’-]+", sentence)))
    return [n for n in lengths if n > 2]


def test_words_of_sentences_are_counted():
    assert sentence_lengths("One two three. Four `a b c` six!\n\n* A [link here](x.md) is read.") == [3, 3, 5]


@pytest.mark.parametrize("page", [*WRITTEN, *TEMPLATES], ids=lambda page: f"{page.parent.name}/{page.name}")
def test_half_of_the_sentences_of_a_page_have_at_most_25_words(page):
    lengths = sentence_lengths(prose(page))
    assert not lengths or statistics.median(lengths) <= 25


def test_half_of_all_sentences_of_the_documentation_have_at_most_18_words():
    assert statistics.median([n for page in WRITTEN for n in sentence_lengths(prose(page))]) <= 18


@pytest.mark.parametrize(
    "page",
    [p for p in [*WRITTEN, *TEMPLATES] if p.name != "glossary.md"],
    ids=lambda page: f"{page.parent.name}/{page.name}",
)
def test_no_page_has_a_term_that_was_replaced(page):
    text = prose(page) + "\n".join(line for line in page.read_text(encoding="utf-8").splitlines() if line[:1] == "#")
    assert [found[0] for found in DIALECT.finditer(text)] == []
