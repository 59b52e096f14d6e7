"""Does the study know on which line each key stands, however the TOML is laid out?"""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from upright.study.text import key_lines

LAID_OUT = '''# a comment = "with [brackets] { and = signs"
title = "quoted # no comment [x] = { y"
long = """
[not.a.table]
key = 1
"""
[rig]
plant = 'pendulum' # [runs]
[parameters]
m_p = { value = "1 kg", uncertainty = "1 %" }
"l_cg" = 0.23
nested.deep = { a = 1, b = { c = 2 } }
list = [
    1.0,
    [2, 3],  # comment ]
    { here = 4 },
]
after = 1
[[runs]]
label = "a"
sensors.theta.sign = -1
[[runs]]
label = "b"
[runs.loop]
gains = { x = "2.5 V/m" }
[sensors.x]
column = "z"
'''


@pytest.mark.parametrize(
    ("path", "line"),
    [
        (("title",), 2),
        (("long",), 3),
        (("rig",), 7),
        (("rig", "plant"), 8),
        (("parameters", "m_p", "uncertainty"), 10),
        (("parameters", "l_cg"), 11),
        (("parameters", "nested", "deep", "b", "c"), 12),
        (("parameters", "list", 2, "here"), 16),
        (("parameters", "after"), 18),
        (("runs", 0), 19),
        (("runs", 0, "label"), 20),
        (("runs", 0, "sensors", "theta", "sign"), 21),
        (("runs", 1, "label"), 23),
        (("runs", 1, "loop", "gains", "x"), 25),
        (("sensors", "x", "column"), 27),
    ],
)
def test_every_key_is_found_on_its_line(path, line):
    assert key_lines(LAID_OUT)[path] == line


def test_nothing_in_a_string_or_a_comment_is_taken_for_a_key():
    def keys(value, path=()):
        if isinstance(value, dict):
            for key, inner in value.items():
                yield (*path, key)
                yield from keys(inner, (*path, key))
        elif isinstance(value, list) and any(isinstance(v, dict) for v in value):
            for i, inner in enumerate(value):
                if isinstance(inner, dict):
                    yield (*path, i)
                    yield from keys(inner, (*path, i))

    found = {path for path in key_lines(LAID_OUT) if not (path[-1] == 2 and path[-2] == "list")}
    expected = {path for path in keys(tomllib.loads(LAID_OUT)) if not (path[-1] == 2 and path[-2] == "list")}
    assert found == expected


NAMES = st.text("abcdefgh_-", min_size=1, max_size=8)
VALUES = st.one_of(
    st.integers(), st.text("abc #[]{}=,.", max_size=9), st.lists(st.integers(), max_size=3), st.booleans()
)


@given(st.dictionaries(NAMES, st.dictionaries(NAMES, VALUES, max_size=5), min_size=1, max_size=5))
def test_lines_agree_with_where_the_writer_put_them(tables):
    lines, expected = [], {}
    for name, table in tables.items():
        lines.append(f"[{name}]")
        expected[(name,)] = len(lines)
        for key, value in table.items():
            text = f'"{value}"' if isinstance(value, str) else str(value).lower()
            lines.append(f"{key} = {text}")
            expected[name, key] = len(lines)
    text = "\n".join(lines) + "\n"
    tomllib.loads(text)
    assert key_lines(text) == expected
