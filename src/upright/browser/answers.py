"""What several addresses of the bench answer alike."""

from __future__ import annotations

import math
from pathlib import Path

from starlette.responses import FileResponse, PlainTextResponse, Response

from upright.errors import UprightError
from upright.records import Array


def nothing() -> Response:
    """That there is nothing here."""
    return PlainTextResponse("There is nothing here.", status_code=404)


def not_theirs() -> Response:
    """That somebody else's files are not for them."""
    return PlainTextResponse("In a class the files of a twin are for its operator and the instructor.", status_code=403)


def report_page(path: Path) -> Response:
    """A report, which has a policy of its own."""
    headers = {"content-security-policy": "frame-ancestors 'self'"}
    return FileResponse(path, media_type="text/html", headers=headers)


def sentence_of(error: UprightError) -> str:
    """What it says, beginning as a sentence does."""
    text = str(error)
    return text[:1].upper() + text[1:]


def five_digits(values: Array) -> list[float | None]:
    """Five digits of each; None where there is no number, which JSON cannot hold."""
    return [float(f"{v:.5g}") if math.isfinite(v) else None for v in values.tolist()]


def thinned(t: Array, y: Array, buckets: int) -> list[list[float | None]]:
    """Times and values of a curve with at most two samples a bucket, as a page draws it."""
    from upright.report.drawing import decimated

    return [five_digits(column) for column in decimated(t, y, buckets)]
