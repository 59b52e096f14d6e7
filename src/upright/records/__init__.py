"""What was measured, when, in which units, and where it came from."""

from __future__ import annotations

from upright.records.record import LARGEST, Array, PathLike, Provenance, Record

__all__ = ["LARGEST", "Array", "PathLike", "Provenance", "Record"]
