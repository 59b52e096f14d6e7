"""Is a list of names read as whoever wrote it meant it, or refused in a sentence?"""

from __future__ import annotations

import pytest

from upright.browser.classroom.roster import MOST, read_roster
from upright.errors import BadInput


def roster(tmp_path, content):
    path = tmp_path / "roster.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_roster(path)


@pytest.mark.parametrize(
    "content",
    [
        "name,seed\nÄnne Müller,\nBob,7\n",
        "name;seed\r\nÄnne Müller;\r\nBob;7\r\n",
        "\ufeffname\tseed\n\nÄnne  Müller\t\n\n,\nBob\t7",
        "Name, Seed\n A\u0308nne Mu\u0308ller ,\n Bob , 7\n;;\n",
        "seed;name\n;Änne Müller\n7;Bob\n",
        "Änne Müller\nBob,7\n",
        "name;seed\nÄnne Müller;\nBob;7\n".encode("latin-1"),
        "name,seed\nÄnne Müller,\nBob,7\n".encode("utf-16"),
        '"name","seed"\n"Änne Müller",""\n"Bob","7"\n',
    ],
)
def test_the_same_class_is_read_however_its_list_was_saved(tmp_path, content):
    assert [(s.name, s.address, s.seed) for s in roster(tmp_path, content)] == [
        ("Änne Müller", "anne-muller", 1), ("Bob", "bob", 7)
    ]  # fmt: skip


def test_everybody_has_an_address_of_their_own(tmp_path):
    """Names that differ in an accent only, one like the instructor's page, letters that are not Latin."""
    students = roster(tmp_path, "name\nJosé\nJose\nclass\n李雷\n韩梅梅\nStraße\n")
    assert [s.address for s in students] == ["jose", "jose-2", "class-2", "student", "student-2", "strasse"]


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("", "names no student"),
        ("\n;;\n", "names no student"),
        ("name\n", "below its header"),
        ("name\nAda\nBob\nada\n", r"line 4: 'ada' stands in line 2 already"),
        ("name,seed\nAda,x\n", "line 2: a seed is a whole number"),
        ("name,seed\nAda,-1\n", "line 2: a seed is a whole number"),
        ("name,grade\nAda,1\n", "columns 'name' and 'seed', got 'grade'"),
        ("name\nLovelace, Ada\n", "line 2: got 2 entries, and there are 1 columns"),
        ("name;seed\n;7\n", "line 2: a name has 1 to 60 letters"),
        ("name\n" + "x" * 61, "line 2: a name has 1 to 60 letters"),
        ("name\n" + "".join(f"s{k}\n" for k in range(MOST + 1)), "split it"),
        (b"name\n\x00\x01", "binary"),
    ],
)
def test_what_is_no_list_of_names_is_refused_in_a_sentence(tmp_path, content, sentence):
    with pytest.raises(BadInput, match=sentence):
        roster(tmp_path, content)
