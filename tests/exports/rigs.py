"""Identified rigs with a covariance, as values and as the file that `upright identify` writes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from upright.physics import Plant


def fit_file(
    folder: Path, plant: Plant, *, name: str, stderr: Mapping[str, float] | None = None, unit: str = "N m",
    **more: Any,
) -> Path:  # fmt: skip
    """A fit.json whose estimates are those with a standard error, independent of each other."""
    stderr = stderr or {}
    values = {**plant.parameters(), "actuator.gain": 0.5, **more.pop("values", {})}
    known = {"stderr": 0.0, "unit": "", "status": "known"}
    entries = {n: {"value": v, **known} for n, v in values.items()}
    entries["actuator.gain"]["unit"] = f"{unit}/V"
    for n, error in stderr.items():
        entries[n] |= {"stderr": error, "status": "well determined"}
    content = {
        "format": 1, "plant": name, "verdict": "", "trusted": True, "parameters": entries,
        "estimated": list(stderr), "correlation": np.eye(len(stderr)).tolist(),
        "rig": {"entries": {"limit": {"value": 5.0, "unit": "V", "source": "known"}, **more}},
    }  # fmt: skip
    path = folder / "fit.json"
    path.write_text(json.dumps(content), encoding="utf-8")
    return path
