"""What was learned? Fits and logs as pictures, tables and one page that stands by itself."""

from __future__ import annotations

from upright.report.document import write_fit_report

__all__ = ["write_fit_report"]
