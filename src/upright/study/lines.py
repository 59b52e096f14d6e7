"""On which line of a TOML text does each key stand? `tomllib` does not tell."""

from __future__ import annotations

import re

KeyPath = tuple[str | int, ...]
"""Keys from the root down; the entries of a list of tables are counted from 0."""

_TOKEN = re.compile(
    r"""(?P<string>\"\"\"(?:\\.|[^\\])*?\"\"\"|'''.*?'''|"(?:\\.|[^"\\\n])*"|'[^'\n]*')"""
    r"""|(?P<comment>\#[^\n]*)|(?P<newline>\n)|(?P<mark>[\[\]{},=.])|(?P<bare>[^\s\[\]{},=.\#"']+)""",
    re.DOTALL,
)


def key_lines(text: str) -> dict[KeyPath, int]:
    """Line (from 1) of every key and table of valid TOML; list entries are counted from 0.

    Follows tables, lists of tables, dotted keys and inline tables; strings and comments are passed over.
    """
    lines: dict[KeyPath, int] = {}
    counts: dict[KeyPath, int] = {}
    base: KeyPath = ()
    stack: list[tuple[str, KeyPath]] = []  # open inline tables and lists, with the path they stand for
    key: list[str] = []
    pending: KeyPath = ()
    header = 0  # brackets of a table header that are open
    in_value = False
    line = 1
    start_of_line = True

    def note(path: KeyPath) -> None:
        for cut in range(1, len(path) + 1):
            lines.setdefault(path[:cut], line)

    for token in _TOKEN.finditer(text):
        kind, word = token.lastgroup, token.group()
        if kind == "newline":
            line += 1
            if not stack:
                in_value, start_of_line, key, header = False, True, [], 0
            continue
        if kind == "comment":
            continue
        if header or (start_of_line and word == "[" and not stack):
            if word == "[":
                header += 1
            elif word == "]":
                if key:
                    base = _enter(tuple(key), counts, is_list=header == 2)
                    note(base)
                key = []
            elif word != ".":
                key.append(_unquote(word, kind))
            start_of_line = False
            continue
        start_of_line = False
        owner = stack[-1] if stack else ("{", base)
        if not in_value and owner[0] == "{":
            if word == "=":
                pending = (*owner[1], *key)
                note(pending)
                key, in_value = [], True
            elif word == "}":
                stack.pop()
                in_value = True
            elif word not in (".", ","):
                key.append(_unquote(word, kind))
        elif word == "{":
            stack.append(("{", pending))
            in_value = False
        elif word == "[":
            stack.append(("[", pending))
            counts[pending] = 0
            pending = (*pending, 0)
        elif word == "]" or word == "}":
            if stack:
                pending = stack.pop()[1]
        elif word == ",":
            if owner[0] == "{":
                in_value = False
            else:
                counts[owner[1]] = counts.get(owner[1], 0) + 1
                pending = (*owner[1], counts[owner[1]])
        line += word.count("\n") if kind == "string" else 0
    return lines


def _enter(key: tuple[str, ...], counts: dict[KeyPath, int], *, is_list: bool) -> KeyPath:
    """Path of a table header, with the running number of each list of tables on the way."""
    path: KeyPath = ()
    for i, part in enumerate(key):
        path = (*path, part)
        last = i == len(key) - 1
        if last and is_list:
            counts[path] = counts.get(path, -1) + 1
        if path in counts:
            path = (*path, counts[path])
    return path


def _unquote(word: str, kind: str | None) -> str:
    return word[1:-1] if kind == "string" else word
