"""What was measured, when, in which units, and where did it come from?

A `Record` is what one layer hands the next: readers make it, the estimator
reads it, reports draw it. It is checked when built, so nobody checks again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from upright.errors import BadInput, nearest
from upright.records.exchange import Array, Exchange
from upright.records.provenance import Provenance
from upright.shown import Shown

# No laboratory instrument writes a number this large, and its square would overflow in a fit.
LARGEST = 1e30


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Record(Exchange, Shown):
    """Signals sampled at the same instants.

    Parameters
    ----------
    t : (N,) array
        Time [s], strictly increasing, N >= 2.
    signals : mapping of name to (N,) array
        Every column by its name in the log; finite. The time column itself is `t`.
    units : mapping of name to str, optional
        Unit as the log states it (``"counts"``, ``"V"``, ``"rad"``); ``"1"`` for a pure number,
        ``""`` when the log does not say.
    inputs, outputs : tuple of str, optional
        Names of the signals that drive and that are measured; empty while unknown.
    provenance : Provenance, optional

    Raises
    ------
    BadInput
        When time does not increase, a value is not finite or beyond 1e30, lengths differ, or a name is unknown.
    """

    t: Array
    signals: Mapping[str, Array]
    units: Mapping[str, str] = field(default_factory=dict[str, str])
    inputs: tuple[str, ...] = ()
    outputs: tuple[str, ...] = ()
    provenance: Provenance = field(default_factory=Provenance)

    def __post_init__(self) -> None:
        t = _column("time", self.t)
        if t.size < 2:
            raise BadInput(f"A record needs at least 2 samples, got {t.size}; is the log cut short?")
        step = np.diff(t)
        if not (step > 0).all():
            i = int(np.argmax(step <= 0))
            raise BadInput(
                f"Time must increase from sample to sample, but sample {i + 2} is at {t[i + 1]:.9g} s after"
                f" {t[i]:.9g} s; sort the rows or read each run on its own."
            )
        signals = {str(name): _column(f"column '{name}'", values) for name, values in self.signals.items()}
        for name, values in signals.items():
            if values.size != t.size:
                raise BadInput(
                    f"Column '{name}' needs {t.size} samples, one per time, got {values.size};"
                    " give every column the same time base."
                )
        for name in self.units:
            self._known(name, signals, "units")
        for role, names in (("inputs", self.inputs), ("outputs", self.outputs)):
            for name in names:
                self._known(name, signals, role)
        object.__setattr__(self, "t", t)
        object.__setattr__(self, "signals", signals)
        object.__setattr__(self, "units", {name: str(self.units.get(name, "")) for name in signals})
        object.__setattr__(self, "inputs", tuple(self.inputs))
        object.__setattr__(self, "outputs", tuple(self.outputs))

    @staticmethod
    def _known(name: str, signals: Mapping[str, Array], where: str) -> None:
        if name not in signals:
            raise BadInput(f"The record has no column '{name}', named under {where}: {nearest(name, signals)}")

    def __len__(self) -> int:
        return self.t.size

    def __getitem__(self, name: str) -> Array:
        """Samples (N,) of one column, in the unit of the log.

        Raises
        ------
        BadInput
            When there is no such column, with its nearest name.
        """
        if name not in self.signals:
            raise BadInput(
                f"{self.provenance.file or 'the log'} has no column '{name}'; {nearest(name, self.signals)}"
                f" (it holds {', '.join(self.signals)})"
            )
        return self.signals[name]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns, in the order of the log."""
        return tuple(self.signals)

    @property
    def period(self) -> float:
        """Median time between samples [s]."""
        return float(np.median(np.diff(self.t)))

    @property
    def u(self) -> Array:
        """Inputs (N, n_inputs) in the units of the log."""
        return self._stack(self.inputs)

    @property
    def y(self) -> Array:
        """Outputs (N, n_outputs) in the units of the log."""
        return self._stack(self.outputs)

    def _stack(self, names: tuple[str, ...]) -> Array:
        out = np.empty((self.t.size, len(names)))
        for j, name in enumerate(names):
            out[:, j] = self.signals[name]
        return out

    def window(self, start: float, stop: float) -> Record:
        """Part with start <= t <= stop [s]; times stay as they are."""
        lo, hi = np.searchsorted(self.t, (start, np.nextafter(stop, np.inf)))
        if hi - lo < 2:
            raise BadInput(
                f"The window {start:g} to {stop:g} s holds {max(hi - lo, 0)} samples and needs at least 2;"
                f" this record runs from {self.t[0]:g} to {self.t[-1]:g} s."
            )
        return replace(
            self,
            t=self.t[lo:hi],
            signals={name: values[lo:hi] for name, values in self.signals.items()},
            provenance=replace(self.provenance, window=(float(start), float(stop))),
        )

    def animate(self, *, speed: float = 1.0, frames: int = 25) -> Any:
        """Moving drawing of a rig whose coordinates are columns; see `upright.views.animation.animate`."""
        from importlib import import_module

        return import_module("upright.views.animation").animate(self, speed=speed, frames=frames)

    def replace(self, **changes: Any) -> Record:
        """Record with some fields changed, checked again."""
        return replace(self, **changes)


def _column(what: str, values: Any) -> Array:
    """Read-only float64 copy, one-dimensional and finite."""
    try:
        out = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise BadInput(f"{what} must be numbers, got something else ({error}); convert it first.") from None
    if out.ndim != 1:
        raise BadInput(f"{what} must be one-dimensional, got shape {out.shape}; give each column its own name.")
    bad = ~(np.abs(out) <= LARGEST)  # catches nan and inf as well
    if bad.any():
        i = int(np.argmax(bad))
        raise BadInput(
            f"{what} must be finite and below {LARGEST:g}, got {out[i]:g} at sample {i + 1};"
            " remove the sample or fill it in."
        )
    out.flags.writeable = False
    return out
