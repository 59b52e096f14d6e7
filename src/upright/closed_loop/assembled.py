"""How does a fitted regression become a law? Channels as a program writes them, and the state space that starts where
the log does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from upright.closed_loop.law import SampledLaw
from upright.closed_loop.regression import Regression
from upright.closed_loop.regressors import Signals
from upright.closed_loop.structures import Channel, Filter, joined, memory

Gains = Mapping[tuple[str, int], float]


def gains_of(best: Regression) -> dict[tuple[str, int], float]:
    """Gains by term."""
    return dict(zip(best.found.terms, best.gains.tolist(), strict=True))


def channels_of(best: Regression, measured: Sequence[str], references: Sequence[str]) -> tuple[Channel, ...]:
    """The law as a program writes it."""
    gains = gains_of(best)
    out: list[Channel] = []
    for i, name in enumerate(measured):
        first, second = gains.get(("kd", i), 0.0), gains.get(("kd2", i), 0.0)
        kd = first + second
        channel = Channel(
            measured=name,
            reference=references[i] if i < len(references) else "",
            kp=gains.get(("kp", i), 0.0),
            ki=gains.get(("ki", i), 0.0),
            kd=kd,
            on=best.family.on,
            filter=Filter(pole=best.pole, second=second / kd if kd else 0.0),
        )
        if channel.kp or channel.ki or channel.kd:
            out.append(channel)
    return tuple(out)


def law_of(best: Regression, channels: Sequence[Channel], signals: Signals, limit: float) -> SampledLaw:
    """State space of the channels, its memory as the regression found it before the first row."""
    gains = gains_of(best)
    constant = gains.get(("1", 0), 0.0)
    sums = [c for c in channels if c.ki]
    law = joined(
        channels, period=signals.period, bias=0.0 if sums else constant, limit=limit, delay=float(best.family.delay),
        windup="hold" if best.family.hold else "free",
    )  # fmt: skip
    first: dict[str, float] = {}
    for channel in channels:
        y, r = signals.pairs[signals.names.index(channel.measured)]
        first |= {channel.measured: float(y[0])} | ({channel.reference: float(r[0])} if r is not None else {})
    smoothed = {name: gains.get(("start", i), 0.0) for i, name in enumerate(signals.names)}
    return replace(law, initial=memory(channels, first, constant=constant, smoothed=smoothed))


def sensible(made: Regression) -> bool:
    """Whether taps average: shares between zero and one. Others guess at what happened between two rows."""
    gains = gains_of(made)
    pairs = [(gains[("kd", i)], second) for (kind, i), second in gains.items() if kind == "kd2"]
    return all(first * second >= 0 for first, second in pairs)


def structure(f: Regression, measured: Sequence[str]) -> str:
    """Structure in words, such as "PD of theta and alpha; filtered difference of the error"."""
    letters = {"kp": "P", "ki": "I", "kd": "D"}
    kinds = ["".join(letters[k] for k in letters if (k, i) in f.found.terms) for i in range(len(measured))]
    if len(kinds) == 1:
        words = [kinds[0]]
    elif len(set(kinds)) == 1:
        words = [f"{kinds[0]} of {' and '.join(measured)}"]
    else:
        words = [", ".join(f"{kind} of {name}" for kind, name in zip(kinds, measured, strict=True) if kind)]
    if any("D" in kind for kind in kinds):
        how = {"difference": "plain", "two taps": "two-tap", "filter": "filtered"}[f.family.smoothing]
        words.append(f"{how} difference of the {f.family.on}")
    if f.family.delay:
        words.append("one sample late")
    if f.family.hold:
        words.append("sum held at the limit")
    return "; ".join(words)
