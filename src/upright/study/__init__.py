"""A study file (TOML) becomes a rig and its runs, in SI, and back."""

from __future__ import annotations

from upright.study.load import Study, load_study

__all__ = ["Study", "load_study"]
