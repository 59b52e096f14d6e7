"""What was measured, when, in which units, and where it came from."""

from upright.records.record import LARGEST, Array, PathLike, Provenance, Record

__all__ = ["LARGEST", "Array", "PathLike", "Provenance", "Record"]
