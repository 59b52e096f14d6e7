"""How does the report get onto paper without a browser?"""

from __future__ import annotations

from pathlib import Path

from upright.report.book import Book


def write_pdf(path: Path, book: Book) -> Path | None:
    """Write the report as PDF, or nothing where the `pdf` extra is not installed."""
    return None
