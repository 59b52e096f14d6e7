"""Scripts and styles of pictures that answer, and the policy under which a page runs them."""

from __future__ import annotations

import base64
import hashlib
import re
from functools import cache
from importlib.resources import files

_OURS = re.compile(r"^\s*//.*\n|^\s+", re.MULTILINE)
_BANNER = "/* uPlot 1.6.32, copyright (c) 2022 Leon Sorokin, MIT License */\n"


@cache
def script() -> str:
    """UPlot and what is put on it, without comments and indentation."""
    vendored = _file("uplot/uPlot.iife.min.js").partition("\n")[2]
    return _BANNER + vendored + _OURS.sub("", _file("traces.js"))


@cache
def style() -> str:
    """Their looks."""
    return _file("uplot/uPlot.min.css") + "\n" + _file("answers.css")


def policy(scripts: list[str], *, frames: list[str]) -> str:
    """Content-security policy of a page: nothing is fetched or evaluated, only these scripts run.

    Parameters
    ----------
    scripts : list of str
        Scripts of the page.
    frames : list of str
        Pages that it frames, whose scripts run under its policy and under their own.
    """
    framed = [
        text for frame in frames for text in re.findall(r"<script id=\"script\">(.*?)</script>", frame, re.DOTALL)
    ]
    allowed = " ".join(f"'sha256-{_digest(text)}'" for text in [*scripts, *framed]) or "'none'"
    moving = " 'wasm-unsafe-eval' blob:; worker-src blob:" if framed else ""
    return f"default-src 'none'; img-src data:; font-src data:; style-src 'unsafe-inline'; script-src {allowed}{moving}"


def _file(name: str) -> str:
    return files("upright.report.interactive").joinpath(name).read_text(encoding="utf-8")


def _digest(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
