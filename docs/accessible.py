"""What screen readers and keyboards need and neither Sphinx nor the theme writes: levels, names, focus where it scrolls."""

from __future__ import annotations

from pathlib import Path
from typing import Any

MENDED = {
    '<p class="caption" role="heading">': '<p class="caption" role="heading" aria-level="2">',
    '<aside class="sidebar-drawer">': '<aside class="sidebar-drawer" aria-label="All pages">',
    '<aside class="toc-drawer">': '<aside class="toc-drawer" aria-label="On this page">',
    "<pre>": '<pre tabindex="0">',
    '<th class="head"><p></p></th>': "<td></td>",
}


def setup(app: Any) -> dict[str, bool]:
    """Sphinx calls this."""
    app.connect("build-finished", _mend)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _mend(app: Any, error: Exception | None) -> None:
    """Each page, where the build came to its end; reports and live twins are not of the theme."""
    for page in () if error else sorted(Path(app.outdir).rglob("*.html")):
        text = page.read_text(encoding="utf-8")
        if 'class="sidebar-drawer"' in text:
            for written, wanted in MENDED.items():
                text = text.replace(written, wanted)
            page.write_text(text, encoding="utf-8")
