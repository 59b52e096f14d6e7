"""Which lines of a template were ever rendered: a sentence that no test prints is a claim that nobody has checked."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import CodeType, FrameType
from typing import Any

from upright.report.prose import templates_of


class Rendered:
    """Lines of the template beside a module, and those of them that were printed so far."""

    def __init__(self, module: str, template: str = "") -> None:
        package, _, own = module.rpartition(".")
        self._template = templates_of(package).get_template(f"{template or own}.md")
        self._code = set(_lines(self._template.root_render_func.__code__))
        for block in self._template.blocks.values():
            self._code |= set(_lines(block.__code__))
        self._seen: set[int] = set()

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Counts what is rendered meanwhile."""
        before = sys.gettrace()

        def lines(frame: FrameType, event: str, _: Any) -> Any:
            self._seen.add(frame.f_lineno)
            return lines

        def calls(frame: FrameType, event: str, _: Any) -> Any:
            return lines if frame.f_code.co_filename == self._template.filename else None

        sys.settrace(calls)
        try:
            yield
        finally:
            sys.settrace(before)

    @property
    def missed(self) -> dict[int, str]:
        """Lines of the template that were not rendered, by their numbers; those that only name things are no claims."""
        assert self._template.filename is not None
        with open(self._template.filename, encoding="utf-8") as file:
            text = file.read().splitlines()
        numbers = sorted({self._template.get_corresponding_lineno(n) for n in self._code - self._seen})
        # Jinja looks its filters up in the first line, each with an error for one that there is not
        return {n: text[n - 1] for n in numbers if n > 1 and not text[n - 1].startswith(("{% macro", "{% set"))}


def _lines(code: CodeType) -> Iterator[int]:
    """Every line of a template's compiled code, macros and loops included."""
    yield from (line for _, _, line in code.co_lines() if line is not None and line > code.co_firstlineno)
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from _lines(inner)
