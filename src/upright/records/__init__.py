"""What was measured, when, in which units, and where it came from."""

from __future__ import annotations

from upright.records.exchange import Array, PathLike
from upright.records.provenance import Provenance
from upright.records.record import LARGEST, Record

__all__ = ["LARGEST", "Array", "PathLike", "Provenance", "Record"]
