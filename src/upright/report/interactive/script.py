"""The script of pictures that answer: uPlot, their style, and what draws them."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any

_COMMENTS = re.compile(r"^\s*//.*\n|^\s+", re.MULTILINE)
_BANNER = "/* uPlot 1.6.32, copyright (c) 2022 Leon Sorokin, MIT License */\n"


def in_script(data: Mapping[str, Any]) -> str:
    """JSON that may stand inside a script."""
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


@cache
def cursor_script() -> str:
    """The cursor of charts, which needs no library."""
    return _COMMENTS.sub("", _file("charts.js"))


@cache
def script() -> str:
    """All of it, without comments and indentation; the style comes with it, so that a page has only to run it."""
    library = _file("uplot/uPlot.iife.min.js").partition("\n")[2]
    sheet = json.dumps(_file("uplot/uPlot.min.css") + _file("answers.css"))
    styled = (
        f"document.adoptedStyleSheets = [new CSSStyleSheet()]; document.adoptedStyleSheets[0].replaceSync({sheet});"
    )
    return "\n".join([_BANNER + library, styled, _COMMENTS.sub("", _file("traces.js"))])


def _file(name: str) -> str:
    return files("upright.report.interactive").joinpath(name).read_text(encoding="utf-8")
