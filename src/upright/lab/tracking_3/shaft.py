"""What is the shaft like? A few pulses of the drive, a log, a study, a fit: the model that experiment 3 designs with.

Pulses come in pairs of pairs, forth, twice back and forth, which bring two inertias without a spring to ground back to
about where they began; pauses between them let dry friction show.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from upright.control import Rig
from upright.errors import BadInput
from upright.identification import Fit
from upright.lab.weighing_1a.run import Known
from upright.physics import Plant, chain
from upright.progress import Progress, part, silent
from upright.records import Provenance, Record
from upright.study.load import Study

EVERY = 5
"""Servo periods per logged sample."""
STUDY = "shaft.toml"
FIT = "fit.json"

_PULSES = {"pulses.csv": ((0.06, 0.10, 0.05, 0.08, 0.06, 0.04), 1.0), "others.csv": ((0.09, 0.05, 0.10, 0.07), 0.7)}
"""Widths [s] of a log's pulses, and their size beside `Shaft.volts`: the first is fitted, the second predicted."""
_PAUSE = 0.35


@dataclass(frozen=True, kw_only=True)
class Shaft:
    """What is said about a make before it is measured: names, nominal numbers, what breaks.

    Attributes
    ----------
    plant : str
        As a study calls it.
    gain : float
        Force per unit of command, as the makers state it.
    gain_unit : str
    gain_error : float
        Relative standard uncertainty of the gain; poles and gains of the loop do not depend on it.
    volts : float
        Size of the pulses.
    twist : float
        Largest allowed distance between the two bodies, by which the shaft trips; inf for springs that bear it.
    """

    plant: str
    gain: float
    gain_unit: str
    volts: float
    twist: float = np.inf
    gain_error: float = 0.02


Kind = Literal["rectilinear", "torsional"]
KINDS: tuple[Kind, ...] = ("rectilinear", "torsional")
SHAFTS: dict[Kind, Shaft] = {
    "rectilinear": Shaft(plant="rectilinear-2", gain=5.25, gain_unit="N/V", volts=0.6),
    "torsional": Shaft(plant="torsional-2", gain=0.65, gain_unit="N m/V", volts=0.4, twist=np.radians(25)),
}


def kind_of(rig: Rig) -> Kind:
    """Whether a rig with two inertias is rectilinear or torsional."""
    return _kind(rig.plant, rig.name)


def _kind(plant: Plant, name: str) -> Kind:
    for kind in KINDS:
        if isinstance(plant, chain(2, kind)):
            return kind
    raise BadInput(
        f"tracking needs two inertias on a shaft (rectilinear-2 or torsional-2), not {name}; fit such a plant first."
    )


def from_file(path: Path, limit: float | None = None) -> tuple[Kind, Rig]:
    """The rig that a fit or a study describes; what neither says, limit, counts and period, is the make's."""
    from upright.lab.rigs.makes import make_rig
    from upright.lab.rigs.rig_file import read_rig_file

    file = read_rig_file(path)
    kind = _kind(file.plant, f"'{file.name}'")
    p = file.plant.parameters()
    if p["k_1"] or p["k_2"]:
        raise BadInput("tracking is for bodies without springs to ground, and k_1 or k_2 of this fit is not zero.")
    made = make_rig(kind)
    return kind, replace(
        made, plant=file.plant, gain=file.gain, unit=file.unit or made.unit, delay=file.late or made.delay,
        lag=file.lag, limit=limit or made.limit, name=f"the rig of {path.name}",
    )  # fmt: skip


def pulses(rig: Rig, file: str) -> Record:
    """Log of what the encoders show, in counts, while the drive pulses [V]."""
    from upright.simulation import simulate

    widths, share = _PULSES[file]
    volts = round(share * SHAFTS[kind_of(rig)].volts / rig.converter) * rig.converter
    dt = EVERY * rig.period
    parts = [np.zeros(round(_PAUSE / dt))]
    for i, width in enumerate(widths):
        one = np.full(round(width / dt), volts if i % 2 == 0 else -volts)
        parts += [one, -one, -one, one, np.zeros(round(_PAUSE / dt))]
    u = np.concatenate(parts)
    x = simulate(
        rig.plant, rig.drive, rig.plant.state(), np.repeat(u, EVERY), rig.period, samples=u.size, every=EVERY
    )[:, ::2, 0]  # fmt: skip
    names = tuple(c.name for c in rig.plant.coordinates)
    counts = np.floor(x * np.array(rig.counts) + 0.5)
    return Record(
        t=np.arange(u.size, dtype=np.float64) * dt,
        signals={"u": u} | {n: counts[:, i] for i, n in enumerate(names)},
        units={"u": rig.unit} | dict.fromkeys(names, "counts"),
        inputs=("u",),
        outputs=names,
        provenance=Provenance(
            reader="twin",
            rig=f"digital twin of {rig.name}, seed {rig.seed}",
            notes=("This log was simulated; no rig was touched.",),
        ),
    )


def study_text(rig: Rig, seed: int, weighed: Sequence[Known] = ()) -> str:
    """Study of the logs, its guesses 30 % off what the make is designed to be.

    The inertia that experiment 1a weighed is known as well as it says, and the drive's gain follows; else the gain is
    the maker's. The stiffness of 1a is left out: it comes from the same swings and errs with the inertia.
    """
    from upright.lab.rigs.makes import PLANTS

    kind = kind_of(rig)
    shaft, plant = SHAFTS[kind], type(rig.plant)
    designed = PLANTS[kind].parameters()
    rng = np.random.default_rng([seed, 30])
    lines = [
        f'title = "Two inertias on a shaft: {rig.name}"',
        f'source = "digital twin, seed {rig.seed}: simulated, no rig was touched"',
        "",
        "[rig]",
        f'plant = "{shaft.plant}"',
        "",
        "[parameters]",
    ]
    known = {k.name: k for k in weighed if k.name in ("m_1", "J_1")}
    for name, value in designed.items():
        unit = plant.quantity(name).unit
        if name in known:
            value, error = f"{known[name].value:.6g} {unit}", f"{known[name].stderr:.2g} {unit}"
            lines.append(f'{name} = {{ value = "{value}", uncertainty = "{error}" }}  # experiment 1a')
        elif value:
            guess = value * rng.choice([0.7, 1.3])
            lines.append(f'{name} = {{ guess = "{guess:.4g} {unit}", min = 0 }}')
    gain = f'guess = "{shaft.gain:g} {shaft.gain_unit}", min = 0'
    if not known:
        gain = f'value = "{shaft.gain:g} {shaft.gain_unit}", uncertainty = "{100 * shaft.gain_error:g} %"'
    lines += [
        "",
        "[actuator]  # the loop's poles do not depend on the gain, masses and springs do",
        f"gain = {{ {gain} }}",
        f'delay = "{1e3 * rig.delay:g} ms"',
        f'lag = "{1e3 * rig.lag:g} ms"',
        "",
        "[drive]",
        'column = "u"',
        f'unit = "{rig.unit}"',
    ]
    for c, counts in zip(rig.plant.coordinates, rig.counts, strict=True):
        per = f"counts_per_rev = {round(counts * 2 * np.pi)}" if c.unit == "rad" else f"counts_per_m = {counts:.10g}"
        lines += ["", f"[sensors.{c.name}]", f'column = "{c.name}"', 'unit = "counts"', per]
    for role, file in zip(("fit", "predict"), _PULSES, strict=True):
        label = file.removesuffix(".csv")
        lines += ["", "[[runs]]", f'label = "{label}"', f'file = "{file}"', f'role = "{role}"']
    speeds = ", ".join(f"{n} = 0.0" for n in rig.plant.state_names()[1::2])
    lines += ["", "[defaults]", f"initial = {{ {speeds} }}  # at rest", 'unknown = ["initial"]']
    return "\n".join(lines) + "\n"


def weigh(
    rig: Rig, seed: int, folder: Path, tell: Progress = silent, weighed: Sequence[Known] = ()
) -> tuple[Study, Fit]:  # fmt: skip
    """Pulse a rig, write logs and study, and fit it as `upright identify` would; writes `fit.json` too."""
    from upright.identification.estimate import identify
    from upright.study.fit_file import write_fit
    from upright.study.load import load_study

    folder.mkdir(parents=True, exist_ok=True)
    for file in _PULSES:
        pulses(rig, file).to_csv(folder / file)
    path = folder / STUDY
    path.write_text(study_text(rig, seed, weighed), encoding="utf-8")
    study = load_study(path)
    fit = identify(study.rig, study.runs, progress=part(tell, 0.0, 1.0, "fitting the shaft"))
    write_fit(fit, study, folder / FIT)
    return study, fit


def fitted(rig: Rig, fit: Fit) -> Rig:
    """The rig as the fit sees it: same drive, encoders and period, numbers of the plant and gain as estimated."""
    values = {n: p.value for n, p in fit.rig.parameters.items()} | {n: e.value for n, e in fit.estimates.items()}
    plant = rig.plant.replace(**{n: v for n, v in values.items() if n in rig.plant.names()})
    return replace(rig, plant=plant, gain=values["actuator.gain"])
