"""A rig that is known in part, completed for a run: by what a call gives, and by the data sheet that somebody chose."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from upright.errors import BadInput
from upright.physics import Plant
from upright.records.record import of_twin
from upright.rig.hardware import Entry, check_vendor, meaning_of
from upright.rig.makes import Make, make_of_vendor, make_rig, sheet
from upright.rig.rig import Rig


def completed(
    rig: Rig, entries: Mapping[str, Entry | None] | None = None, *, vendor: str | None = None,
    needs: Collection[str] = ("limit", "servo_period", "counts"), who: str = "a simulation", options: bool = True,
) -> Rig:  # fmt: skip
    """A rig with what is known of its drive, encoders and servo: what a call gives, its own, the data sheet named.

    Where a vendor's data sheet was chosen, dry friction that the fit leaves at zero is that of his rig as designed, and
    the rig is called by his name. A delay that nobody gave is assumed to be one servo period.

    Parameters
    ----------
    entries : mapping of str to Entry, optional
        Options of the command line; None is none.
    vendor : str, optional
        Data sheet chosen by name; the rig's own choice when empty.
    needs : collection of str
        What may not be missing; ``"counts"`` is those of every encoder.
    who : str
        Verb that asks.
    options : bool
        Whether its caller has an option for each number; otherwise only files have them.

    Raises
    ------
    BadInput
        When something is missing, with the options and keys that say it.
    """
    chosen = check_vendor(vendor or rig.hardware.vendor)
    hardware = replace(rig.hardware, vendor=chosen).with_entries(entries or {})
    if chosen:
        hardware = hardware.over(sheet(chosen, rig.plant, rig.unit))
    needed = {"limit": "--limit 10", "servo_period": '--period "2 ms"', "travel": "--travel 0.2"}
    needed |= {f"counts.{c.name}": "--counts 4096" for c in rig.plant.coordinates}
    wanted = {n: option if options else "" for n, option in needed.items() if n.partition(".")[0] in needs}
    hardware.demand(wanted, who, sheet="--vendor NAME" if options else 'vendor = "NAME" in RIG.toml')
    if "delay" not in hardware.entries and "servo_period" in hardware.entries:
        late = Entry(value=hardware.entries["servo_period"].value, unit="s", source="assumed: one servo period")
        hardware = hardware.with_entries({"delay": late})
    make = make_of_vendor(chosen, rig.plant)
    return replace(
        rig, hardware=hardware, name=make.rig.name if make else hardware.name or rig.name,
        plant=_with_friction(rig.plant, make), unit=rig.unit or "V",
    )  # fmt: skip


def twin_of(rig: Rig, seed: int) -> Rig:
    """Another rig to run on: one of the vendor's make, or, of a rig of one's own, one that the covariance allows.

    Limit, period, counts and travel that a call gave are its own too.

    Raises
    ------
    BadInput
        When there is neither.
    """
    make = make_of_vendor(rig.hardware.vendor, rig.plant)
    if make is not None:
        truth = make_rig(make.key, seed)
        typed = {n: e for n, e in rig.hardware.entries.items() if e.source.startswith("--")}
        return replace(truth, hardware=replace(truth.hardware, entries={**truth.hardware.entries, **typed}))
    if not rig.draws:
        raise BadInput(
            "a rig to run on is drawn from the fit's covariance, and this fit has none; give no seed, or "
            "identify the rig from its logs (upright identify)."
        )
    plant, gain = rig.draws[int(np.random.default_rng([seed, 59]).integers(len(rig.draws)))]
    return replace(rig, plant=plant, gain=gain, seed=seed, name=f"a rig that the fit of {rig.name} allows")


def doubts(known: Rig, run: Rig, truth: Rig | None = None) -> tuple[str, ...]:
    """What of a completed rig is somebody else's or assumed, and whether the one that runs is another."""
    out: list[str] = []
    hardware = run.hardware
    sheets = [n for n, e in hardware.entries.items() if e.source.startswith("data sheet")]
    if sheets:
        out.append(f"From the data sheet of the {hardware.vendor}, not specified for this rig: {_list(sheets)}.")
    make = make_of_vendor(hardware.vendor, known.plant)
    if make is not None and run.plant != known.plant:
        out.append(f"The fit knows no dry friction; simulations have that of the {make.rig.name} as designed.")
    assumed = [n for n, e in hardware.entries.items() if e.source.startswith("assumed")]
    if assumed:
        out.append(f"Assumed, not measured: {_list(assumed)}.")
    ran = "" if truth is None else of_twin(truth.name, truth.seed).rig
    if make is not None and truth is not None and hardware.name and hardware.name != ran:
        out.append(f"The fit is of another rig ({hardware.name}) than the one that runs ({ran}).")
    return tuple(out)


def _with_friction(plant: Plant, make: Make | None) -> Plant:
    dry = [n for n in ("b_1c", "b_2c") if n in plant.names()]
    if make is None or not dry or any(getattr(plant, n) for n in dry):
        return plant
    return plant.replace(**{n: getattr(make.rig.plant, n) for n in dry})


def _list(names: Sequence[str]) -> str:
    return ", ".join(meaning_of(n) for n in names)
