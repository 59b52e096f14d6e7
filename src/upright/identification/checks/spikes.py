"""Which single samples jump away and back? A lost count, a transmission error, a flash on an optical disk."""

from __future__ import annotations

from dataclasses import replace

from upright.identification.model.runs import Run
from upright.signals.spikes import spikes, without


def without_spikes(run: Run) -> tuple[Run, list[tuple[float, str]]]:
    """The run with its spikes replaced by what stands beside them, and when they were in which coordinate."""
    y = run.y.copy()
    found: list[tuple[float, str]] = []
    for k, c in enumerate(run.measured):
        at = spikes(run.y[:, k], run.quantum[k] if run.quantum else 0.0)
        y[:, k] = without(run.y[:, k], at)
        found += [(float(t), c) for t in run.t[at]]
    return (replace(run, y=y) if found else run), found
