"""What several addresses of the bench answer alike."""

from __future__ import annotations

from pathlib import Path

from starlette.responses import FileResponse, PlainTextResponse, Response

from upright.errors import UprightError


def nothing() -> Response:
    """That there is nothing here."""
    return PlainTextResponse("There is nothing here.", status_code=404)


def report_page(path: Path) -> Response:
    """A report, which has a policy of its own."""
    headers = {"content-security-policy": "frame-ancestors 'self'"}
    return FileResponse(path, media_type="text/html", headers=headers)


def sentence_of(error: UprightError) -> str:
    """What it says, beginning as a sentence does."""
    text = str(error)
    return text[:1].upper() + text[1:]
