"""Are runs predicted as well as the fit promised? What `upright predict` answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from upright.identification.inference.verdict.predicts import DROP, FEWEST, GOOD
from upright.identification.model.bands import Bands
from upright.identification.model.fit import RunScore


@dataclass(frozen=True, kw_only=True)
class PredictionCheck:
    """Whether the promise was kept, and the sentence that says so."""

    holds: bool
    sentence: str


def promise(
    runs: Mapping[str, RunScore], bands: Bands | None, fitted: Mapping[str, Mapping[str, float]] | None = None
) -> PredictionCheck:
    """Whether predicted runs are met as well as a fit promises; extrapolations are reported first.

    Parameters
    ----------
    runs : mapping of str to RunScore
        Predicted runs by label.
    bands : Bands or None
        What the fit promises. Without it fit percents are compared with those of the `fitted` runs.
    fitted : mapping, optional
        Fit percent by label and signal of the runs that were fitted.
    """
    plain = _kept(runs, bands, fitted)
    outside = [label for label, s in runs.items() if s.beyond]
    if not outside:
        return plain
    return replace(plain, sentence=f"Outside what the fit has seen: {', '.join(outside)}. {plain.sentence}")


def _kept(
    runs: Mapping[str, RunScore], bands: Bands | None, fitted: Mapping[str, Mapping[str, float]] | None
) -> PredictionCheck:
    if bands is None:
        return _as_the_fitted(runs, fitted or {})
    inside = {(label, signal): p for label, s in runs.items() for signal, p in s.inside.items()}
    bare = [f"{signal} of {label}" for label, s in runs.items() for signal in s.fit_percent if signal not in s.band]
    unfitted = f" No band is promised for {', '.join(bare)}, which no fitted run showed." if bare else ""
    if not inside:
        return PredictionCheck(holds=False, sentence=f"Nothing tells how well this is predicted.{unfitted}")
    short = [f"{label} {signal} {p:.0f} %" for (label, signal), p in inside.items() if p < FEWEST]
    level = f"{100 * bands.level:.0f} % bands"
    low, high = min(inside.values()), max(inside.values())
    span = f"{low:.0f} %" if round(low) == round(high) else f"{low:.0f} to {high:.0f} %"
    if short:
        return PredictionCheck(
            holds=False,
            sentence=f"Predicted worse than the fit promises: inside the {level} lie only "
            f"{', '.join(short)} of the samples ({FEWEST:.0f} % is the least).{unfitted}",
        )
    return PredictionCheck(
        holds=True,
        sentence=f"Predicted as well as the fit promises: {span} of the samples lie inside the {level}.{unfitted}",
    )


def _as_the_fitted(runs: Mapping[str, RunScore], fitted: Mapping[str, Mapping[str, float]]) -> PredictionCheck:
    least: dict[str, float] = {}
    for percents in fitted.values():
        for signal, percent in percents.items():
            least[signal] = min(percent, least.get(signal, 100.0))
    short = [
        f"{label} {signal} {percent:.1f} %"
        for label, s in runs.items()
        for signal, percent in s.fit_percent.items()
        if percent < GOOD and percent < least.get(signal, GOOD + DROP) - DROP
    ]
    without = "The fit holds no bands, so none is drawn; identify again to have them."
    if short:
        return PredictionCheck(
            holds=False, sentence=f"Predicted much worse than the fitted runs ({', '.join(short)}). {without}"
        )
    return PredictionCheck(holds=True, sentence=f"Predicted about as well as the fitted runs. {without}")
