"""Debian's Chromium, driven by Playwright: pages as a person sees them."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
WIDTHS = (360, 768, 1280)


@contextmanager
def opened(
    path: Path, *, width: int = 1280, dark: bool = False, script: bool = True
) -> Iterator[tuple[Any, list[str]]]:
    """A page in a browser, and what it complained of or asked a network for."""
    playwright = pytest.importorskip("playwright.sync_api")
    if CHROMIUM is None:
        pytest.skip("Chromium is missing")
    with playwright.sync_playwright() as runner:
        browser = runner.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        context = browser.new_context(
            viewport={"width": width, "height": 800},
            color_scheme="dark" if dark else "light",
            java_script_enabled=script,
        )
        page, wrong = context.new_page(), []
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("console", lambda message: wrong.append(message.text) if message.type == "error" else None)
        page.on("request", lambda r: None if r.url.startswith(("file:", "blob:")) else wrong.append(r.url))
        page.goto(path.as_uri())
        yield page, wrong
        browser.close()


def until(page: Any, condition: str, frames: int = 1500) -> None:
    """Let the page go on, frame by frame, until something holds of it; its own policy forbids Playwright's waiting."""
    held = page.evaluate(
        f"new Promise((tell) => {{ let left = {frames};"
        f" const look = () => ({condition}) ? tell(true) : left-- > 0 ? requestAnimationFrame(look) : tell(false);"
        " look(); })"
    )
    assert held, condition


def settled(page: Any, value: str, frames: int = 1500) -> Any:
    """A value of the page once three frames leave it alone: what was just done may change it at the next one."""
    last = page.evaluate(
        f"new Promise((tell) => {{ let left = {frames}, same = 0, last; const look = () => {{"
        f" const now = JSON.stringify({value}); same = now === last ? same + 1 : 0; last = now;"
        " if (same === 3) tell(now); else if (left-- > 0) requestAnimationFrame(look); else tell(''); }; look(); })"
    )
    assert last, f"{value} never stands still"
    return json.loads(last)
