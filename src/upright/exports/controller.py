"""The sampled law that a program elsewhere is to run, with names, units and what it was designed for."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from upright.basis import DESCRIBED, Basis, of_plain
from upright.errors import BadInput
from upright.laws import Law, Rule, of_values

AGAIN = "write it again with `upright design ... -o FOLDER`"


@dataclass(frozen=True, kw_only=True, eq=False)
class SampledController:
    """One lane of a `Law` with its period, limit and rounding, and how its signals are called.

    Attributes
    ----------
    signs : tuple of float
        Of the encoders, one for each reading.
    title : str
        Rig and equilibrium.
    states_from : str
        How speeds are made of readings.
    delay : float
        How late a command acts, as the design assumed [samples].
    basis : Basis
        What the law was designed from.
    log_zeros : tuple of str
        Readings whose zero the study states, of the session of its log.
    """

    law: Law | Rule
    readings: tuple[str, ...]
    commands: tuple[str, ...]
    references: tuple[str, ...] = ()
    reading_units: tuple[str, ...] = ()
    command_unit: str = ""
    signs: tuple[float, ...] = ()
    title: str = "a sampled law"
    states_from: str = ""
    delay: float | None = None
    basis: Basis = DESCRIBED
    log_zeros: tuple[str, ...] = ()

    @property
    def linear(self) -> Law:
        """The law, where it is one of matrices."""
        assert isinstance(self.law, Law)  # asked before
        return self.law

    @property
    def memories(self) -> int:
        """How many numbers it remembers."""
        return len(self.law.A) if isinstance(self.law, Law) else self.law.compiled_in.states

    @property
    def converter(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Step of each command's converter, 0 for none."""
        return np.broadcast_to(np.asarray(self.law.command_resolution, dtype=np.float64), (len(self.commands),))

    @property
    def encoder(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Step of each encoder, 0 for none."""
        return np.broadcast_to(np.asarray(self.law.resolution, dtype=np.float64), (len(self.readings),))

    def _zeroing(self) -> str:
        """Where the readings count from: a counter begins anew wherever its power comes on, as in no log before."""
        if not self.encoder.any():
            return ""
        zeroing = "Encoders count from where they are switched on: zero them at rest, a pendulum hanging, before a run."
        if self.log_zeros:
            zeroing += (
                f" The zeros of {' and '.join(self.log_zeros)} that the study states are those of its log's session; "
                "they are not in this program."
            )
        return zeroing

    @property
    def facts(self) -> list[str]:
        """What a reader of the program has to know, a sentence each."""
        units = [f"{n} [{u}]" if u else n for n, u in zip(self.readings, self.reading_units, strict=True)]
        unit = f" [{self.command_unit}]" if self.command_unit else ""
        rest = [f"{v!r}" for v in self.law.arrays()["target"][0].tolist()] if isinstance(self.law, Law) else []
        sentences = [
            *filter(None, [harmless(self.basis.first_line())]),
            f"Call it every {self.law.needed_period!r} s, with readings taken just before, and put the command out at "
            "once.",
            f"Readings: {', '.join(units)}" + (f"; at rest {', '.join(rest)}." if rest else "."),
            *filter(None, [self._zeroing()]),
            f"Commands: {', '.join(self.commands)}{unit}; "
            + (f"limited to {self.law.limit!r} either way" if math.isfinite(self.law.limit) else "NO LIMIT SPECIFIED")
            + (f", in steps of {self.converter.max():g}." if self.converter.any() else ", not rounded."),
        ]
        if self.references:
            sentences.append(
                f"References: {', '.join(self.references)}" + (", as deviations from rest." if rest else ".")
            )
        if self.states_from:
            sentences.append(f"States from readings: {self.states_from}.")
        if self.delay is not None:
            samples = "sample" if self.delay == 1 else "samples"
            sentences.append(f"Designed for commands that act {self.delay:g} {samples} late in all.")
        return sentences


def of_law(law: Any) -> SampledController:
    """A law that was made in Python.

    Raises
    ------
    BadInput
        When it is none that can be written out: no period, several lanes, a rule without names of its readings.
    """
    if not isinstance(law, Law | Rule):
        raise BadInput(
            f"export takes design.json or its folder, the answer of design(...), a Law or a Rule, got "
            f"{type(law).__name__}; for gains alone make a Law: upright.laws.state_feedback(K, period)."
        )
    lanes = max(law.widths().values())
    if lanes > 1:
        raise BadInput(
            f"a single law is exported, and this one is a batch of {lanes}; take one of them: law.of_lanes(...)"
        )
    _ = law.needed_period  # says so where there is none
    single = {name: a[..., 0] for name, (a, axes) in law.arrays().items() if a.ndim > axes}
    made = replace(law, **single) if single else law
    references = tuple(f"r{i}" for i in range(law.signal().shape[1]))
    if isinstance(law, Rule):
        if not law.measured:
            raise BadInput(
                'to be exported, a rule needs the names of its readings: replace(rule, measured=("theta",)).'
            )
        readings, inputs = law.measured, law.commands(len(law.measured))
    else:
        readings = law.measured or tuple(f"y{i}" for i in range(law.readings))
        references, inputs = law.reference_names or references, len(law.C)
    written = SampledController(
        law=made, readings=tuple(map(harmless, readings)), references=tuple(map(harmless, references)),
        reading_units=("",) * len(readings), signs=(1.0,) * len(readings),
        commands=("u",) if inputs == 1 else tuple(f"u{j}" for j in range(inputs)), delay=law.delay or None,
    )  # fmt: skip
    return written if isinstance(law, Rule) else _without_idle_references(written)


def of_design(content: Any, source: str) -> SampledController:
    """The law of a `design.json` with this content; `source` is what sentences about it call it.

    Raises
    ------
    BadInput
        When it is no design, was written before laws could be exported, or its loop falls.
    """
    if not isinstance(content, Mapping) or not {"law", "K", "period"} <= content.keys():
        raise BadInput(f"{source} is not a design.json; it needs the keys law, K and period: {AGAIN}.")
    missing = [key for key in ("readings", "converter", "command", "margins") if key not in content]
    if not isinstance(content["law"], Mapping) or "kind" not in content["law"]:
        missing.append("the law's kind")
    if missing:
        raise BadInput(f"{source} lacks {', '.join(missing)}; an older version wrote it, so {AGAIN}.")
    if content["margins"] is None:
        raise BadInput(
            f"the loop of {source} is unstable, so its law is not exported: {content.get('verdict', '')} Design a "
            "stable one first."
        )
    try:
        return _without_idle_references(_read(content))
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise BadInput(f"{source} does not hold a law ({error}); {AGAIN}.") from None


def of_swing_up(content: Any, source: str) -> SampledController:
    """The swing-up and catch of a `swing_up.json`, a `Rule` with its limit; see `of_design`.

    Raises
    ------
    BadInput
        When it holds no rule, as older versions wrote it, or its pendulum was not caught.
    """
    again = "write it again with `upright swing-up ... -o FOLDER`"
    if not isinstance(content, Mapping) or not {"rule", "readings", "period", "limit"} <= content.keys():
        raise BadInput(f"{source} is not a swing_up.json with a law; {again}.")
    if not (content.get("swing_up") or {}).get("held"):
        raise BadInput(
            f"the swing-up of {source} did not end upright, so it is not exported: {content.get('verdict', '')}"
        )
    try:
        readings, rule = list(content["readings"]), of_values(content["rule"])
        if not isinstance(rule, Rule) or len(rule.measured) != len(readings):
            raise ValueError(f"it needs a rule of {len(readings)} readings")
        return SampledController(
            law=replace(rule, period=float(content["period"]), limit=float(content["limit"])),
            commands=("u",), command_unit=harmless(str(content.get("command_unit") or "")),
            title=harmless(f"{content.get('rig', 'a rig')}, swing-up and catch"), **_signals(content),
            states_from="filtered differences", basis=of_plain(content.get("basis"), "this swing-up"),
        )  # fmt: skip
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise BadInput(f"{source} does not hold a law ({error}); {again}.") from None


def _signals(content: Mapping[str, Any]) -> dict[str, Any]:
    """Names, units and signs of the readings that a file holds, and whose zeros its study states."""
    readings, entries = list(content["readings"]), (content.get("described") or {}).get("entries", {})
    names = tuple(str(r["name"]) for r in readings)
    return {
        "readings": tuple(map(harmless, names)),
        "reading_units": tuple(harmless(str(r["unit"])) for r in readings),
        "signs": tuple(float(entries.get(f"sign.{n}", {}).get("value", 1.0)) for n in names),
        "log_zeros": tuple(harmless(n) for n in names if entries.get(f"offset.{n}", {}).get("value", 0.0)),
    }


def _read(content: Mapping[str, Any]) -> SampledController:
    designed, readings, limit = of_values(content["law"]), list(content["readings"]), content["limit"]
    if not isinstance(designed, Law) or designed.readings != len(readings):
        raise ValueError(f"it needs matrices for {len(readings)} readings")
    names, others = tuple(str(r["name"]) for r in readings), designed.D.shape[1] - len(readings)
    law = replace(
        designed, measured=names, reference_names=designed.reference_names or ("reference",) * others,
        period=float(content["period"]), limit=math.inf if limit is None else float(limit),
        command_resolution=float(content["converter"]),
        resolution=np.array([r["step"] for r in readings], dtype=np.float64),
    )  # fmt: skip
    at = f" at '{content['at']}'" if content.get("at") else ""
    return SampledController(
        law=law, **_signals(content), commands=(harmless(content["command"]),), references=law.reference_names,
        command_unit=harmless(str(content.get("command_unit") or "")),
        title=harmless(f"{content.get('plant', 'a rig')}{at}"),
        states_from=harmless(str(content.get("states_from", ""))),
        delay=content.get("delay_samples"), basis=of_plain(content.get("basis"), "this design"),
    )  # fmt: skip


def _without_idle_references(made: SampledController) -> SampledController:
    """The same without references that nothing depends on."""
    law, p = made.linear, len(made.readings)
    used = [c for c in range(law.D.shape[1] - p) if law.B[:, p + c].any() or law.D[:, p + c].any()]
    keep = [*range(p), *(p + c for c in used)]
    names = tuple(made.references[c] for c in used)
    return replace(
        made, references=names,
        law=replace(law, B=law.B[:, keep], D=law.D[:, keep], reference_names=names, references=None),
    )  # fmt: skip


def harmless(text: str) -> str:
    """A name as it can stand in a comment or a text of any language, ending neither."""
    printable = "".join(c if c.isprintable() else " " for c in text)
    return printable.replace("\\", "/").replace("*/", "* /").replace("/*", "/ *").replace('"', "'")


def identifiers(names: Sequence[str]) -> list[str]:
    """Names as programs can spell them, each another."""
    made: list[str] = []
    for i, name in enumerate(names):
        plain = "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in name).strip("_") or f"y{i}"
        plain = plain if not plain[0].isdigit() else f"y_{plain}"
        made.append(plain if plain not in made else f"{plain}_{i}")
    return made
