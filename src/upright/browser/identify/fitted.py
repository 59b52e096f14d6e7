"""A rig of the bench as one of its fits describes it, with a law that is designed for that."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from upright.basis import NOT_TRUSTED, SIMULATED
from upright.browser.rig import BenchRig, known_rig, write_proposed_law
from upright.browser.runs import in_own_process
from upright.errors import BadInput
from upright.study.stored_rig import read_stored_rig

LAW = "law.json"


def fitted_rig(rig: BenchRig, fit: Path, of: str) -> BenchRig:
    """The same rig by a fit.json, beside which its RIG.toml and its law are written.

    Its limits, its encoders and what a twin truly is stay as they are.

    Parameters
    ----------
    rig : BenchRig
        As its own RIG.toml describes it.
    of : str
        What the log of the fit is called.

    Raises
    ------
    BadInput
        When the fit is not trusted, or the rig is one that its own description makes.
    """
    path = _described(rig, fit)
    in_own_process(write_proposed_law, path, fit.parent / LAW)
    return _known(rig, path, of)


def fitted_rig_again(rig: BenchRig, fit: Path, of: str) -> BenchRig:
    """The same with the law that was written before, as strictly."""
    return _known(rig, _described(rig, fit), of)


def _described(rig: BenchRig, fit: Path) -> Path:
    """RIG.toml of a rig by a fit that may be used."""
    file = rig.file
    basis = read_stored_rig(fit, draws=0).basis
    if basis.level == NOT_TRUSTED:
        raise BadInput(f"this fit cannot be used, since it is not trusted. {basis.sentence}")
    if file.performed and (file.performed != SIMULATED or not file.make):
        raise BadInput(
            f"{rig.name} is what {file.path.name} describes, and another description would make another rig of it; "
            'name the rig that it truly is, such as make = "furuta".'
        )
    return file.with_fit(fit, fit.parent / "RIG.toml")


def _known(rig: BenchRig, path: Path, of: str) -> BenchRig:
    known = known_rig(path, path.parent / LAW, path.parent)
    return replace(known, name=rig.name, fit=path.parent.name, fit_of=of)
