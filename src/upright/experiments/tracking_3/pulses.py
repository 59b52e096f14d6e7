"""A flexible shaft identified by pulses of its drive: log, study and fit, the model that experiment 3 designs with.

Pulses come in pairs of pairs, forth, twice back and forth, which bring two inertias without a spring to ground back to
about where they began; pauses between them let dry friction show.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from upright.control.trial import twin_log
from upright.errors import BadInput
from upright.experiments.stand.fits import fit_study
from upright.experiments.stand.known import Known
from upright.files import replace_file
from upright.identification.model.fit import Fit
from upright.physics import Plant
from upright.progress import Progress, part, silent
from upright.quantities import with_unit
from upright.records import Record
from upright.rig import Rig
from upright.rig.makes import SHAFTS, Make, make_of
from upright.study.load import Study
from upright.study.stored_fit import basis_of
from upright.study.text import TomlTable, counted_sensor, study_text, table

EVERY = 5
"""Servo periods per logged sample."""
STUDY = "shaft.toml"
FIT = "fit.json"
GAIN_ERROR = "2 %"
"""Standard uncertainty of the drive's gain as the makers state it; poles and gains of the loop do not depend on it."""

_PULSES = {"pulses.csv": ((0.06, 0.10, 0.05, 0.08, 0.06, 0.04), 1.0), "others.csv": ((0.09, 0.05, 0.10, 0.07), 0.7)}
"""Widths [s] of a log's pulses, and their size beside that of the make: the first is fitted, the second predicted."""
_PAUSE = 0.35


def shaft_make(plant: Plant, name: str) -> Make:
    """Make of a rig with two inertias, which its owner calls so."""
    refusal = (
        f"tracking needs two inertias on a shaft (rectilinear-2 or torsional-2), not {name}; fit such a plant first."
    )
    make = make_of(plant, refusal)
    if make.key not in SHAFTS:
        raise BadInput(refusal)
    return make


def rig_of_file(known: Rig, name: str) -> Rig:
    """The completed rig that a fit or a study of this `name` tells of."""
    shaft_make(known.plant, f"'{known.name}'")
    p = known.plant.parameters()
    if p["k_1"] or p["k_2"]:
        raise BadInput("tracking is for bodies without springs to ground, and k_1 or k_2 of this fit is not zero.")
    return replace(known, name=f"the rig of {name}")


def pulses(rig: Rig, file: str) -> Record:
    """Log of what the encoders show, in counts, while the drive pulses [V]."""
    from upright.simulation import simulate

    widths, share = _PULSES[file]
    volts = round(share * shaft_make(rig.plant, rig.name).pulse / rig.converter) * rig.converter
    dt = EVERY * rig.period
    parts = [np.zeros(round(_PAUSE / dt))]
    for i, width in enumerate(widths):
        one = np.full(round(width / dt), volts if i % 2 == 0 else -volts)
        parts += [one, -one, -one, one, np.zeros(round(_PAUSE / dt))]
    u = np.concatenate(parts)
    x = simulate(
        rig.plant, rig.drive, rig.plant.state(), np.repeat(u, EVERY), rig.period, samples=u.size, every=EVERY
    )[:, ::2, 0]  # fmt: skip
    t = np.arange(u.size, dtype=np.float64) * dt
    return twin_log(rig, t, np.floor(x * np.array(rig.per_unit) + 0.5), u, unit="counts")


def shaft_study(rig: Rig, seed: int, weighed: Sequence[Known] = ()) -> str:
    """Study of the logs, its guesses 30 % off what the make is designed to be.

    The inertia that experiment 1a weighed is known as well as it says, and the drive's gain follows; else the gain is
    the maker's. The stiffness of 1a is left out: it comes from the same swings and errs with the inertia.
    """
    make = shaft_make(rig.plant, rig.name)
    rng = np.random.default_rng([seed, 30])
    known = {k.name: k for k in weighed if k.name == make.body}
    parameters = TomlTable("[parameters]")
    for name, value in make.rig.plant.parameters().items():
        unit = make.rig.plant.quantity(name).unit
        if name in known:
            text, error = with_unit(known[name].value, unit, 6), with_unit(known[name].stderr, unit, 2)
            parameters.key(name, {"value": text, "uncertainty": error}, "experiment 1a")
        elif value:
            parameters.key(name, {"guess": with_unit(value * rng.choice([0.7, 1.3]), unit, 4), "min": 0})
    actuator = TomlTable("[actuator]", "the loop's poles do not depend on the gain, masses and springs do")
    gain = with_unit(make.rig.gain, make.gain_unit, 6)
    actuator.key("gain", {"guess": gain, "min": 0} if known else {"value": gain, "uncertainty": GAIN_ERROR})
    actuator.key("delay", with_unit(1e3 * rig.delay, "ms", 6))
    actuator.key("lag", with_unit(1e3 * rig.lag, "ms", 6))
    defaults = TomlTable("[defaults]")
    defaults.key("initial", dict.fromkeys(rig.plant.state_names()[1::2], 0.0), "at rest")
    defaults.key("unknown", ["initial"])
    return study_text(
        (
            table(
                "",
                title=f"Two inertias on a shaft: {rig.name}",
                source=f"digital twin, seed {rig.seed}: simulated, no rig was touched",
            ),
            table("[rig]", plant=make.plant_name, vendor=make.vendor),
            parameters,
            actuator,
            table("[drive]", column="u", unit=rig.unit),
            *(counted_sensor(c.name, c.unit, n) for c, n in zip(rig.plant.coordinates, rig.per_unit, strict=True)),
            *(
                table("[[runs]]", label=file.removesuffix(".csv"), file=file, role=role)
                for role, file in zip(("fit", "predict"), _PULSES, strict=True)
            ),
            defaults,
        )
    )


def identify_shaft(
    rig: Rig, seed: int, folder: Path, progress: Progress = silent, weighed: Sequence[Known] = ()
) -> tuple[Study, Fit]:
    """Pulse a rig, write logs and study, and fit it as `upright identify` would; writes `fit.json` too."""
    folder.mkdir(parents=True, exist_ok=True)
    for file in _PULSES:
        pulses(rig, file).to_csv(folder / file)
    path = folder / STUDY
    replace_file(path, shaft_study(rig, seed, weighed).encode())
    return fit_study(path, part(progress, 0.0, 1.0, "fitting the shaft"))


def fitted(rig: Rig, fit: Fit) -> Rig:
    """The rig as the fit sees it: same drive, encoders and period, plant, gain and verdict as estimated."""
    values = {n: p.value for n, p in fit.model.parameters.items()} | {n: e.value for n, e in fit.estimates.items()}
    plant = rig.plant.replace(**{n: v for n, v in values.items() if n in rig.plant.names()})
    basis = basis_of(fit.verdict, fit.answers, trusted=fit.trusted)
    return replace(rig, plant=plant, gain=values["actuator.gain"], basis=basis)
