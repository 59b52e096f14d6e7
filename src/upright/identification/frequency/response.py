"""A measured frequency response: values, errors, how much of the motion was not a sine; and its file."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from upright.errors import BadInput
from upright.files import read_text, whole_file
from upright.records import PathLike

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def _none() -> Array:
    return np.zeros(0)


def _none_complex() -> Complex:
    return np.zeros(0, dtype=np.complex128)


MARK = "# upright frequency response"
NORMAL = 0.6745
"""Median of the size of a normal variable of deviation 1."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FrequencyResponse:
    """Measured response of one or several outputs to one command.

    Attributes
    ----------
    omega : (F,) array
        Angular frequencies [rad/s], increasing.
    response : (F, n) complex array
        Output per unit of command; phase positive when the output leads.
    outputs : tuple of str
        Names of the n outputs.
    units : tuple of str
        Units of the outputs, then of the command.
    input : str
        Name of the command.
    variance : (F, n) array
        Mean square of the response's error, real and imaginary part together; 0 where nobody says.
    coherence : (F, n) array
        Share of the output's power, harmonics aside, that follows the command; 1 where nobody says.
    distortion : (F, n) array
        Root of the power at harmonics over that at the frequency itself; 0 where nobody says.
    drive : (F,) complex array
        Command at this frequency, its peak and phase; 0 where nobody says, and the motion counts as small then.
    dry : (F, n) complex array
        Viscous friction to which one unit of Coulomb friction of that coordinate came in this motion [s/rad or s/m]:
        ``4/(pi V)`` for a sine of speed V (describing function); 0 where it is left out.
    still : (F, n) array
        Share of the period at less than a twentieth of the highest speed: 0.032 for a sine, more where a joint sticks.
    overtones : (F, n, H) complex array
        Outputs at 2, 3, ... times the frequency, peak and phase; empty where nobody says.
    together : bool
        Whether all frequencies were driven at once (multisine), or one after the other.
    hold : float
        Time for which the converter holds a command [s].
    notes : tuple of str
        What the measurement has to say.
    """

    omega: Array
    response: Complex
    outputs: tuple[str, ...]
    units: tuple[str, ...] = ()
    input: str = "u"
    variance: Array = field(default_factory=_none)
    coherence: Array = field(default_factory=_none)
    distortion: Array = field(default_factory=_none)
    drive: Complex = field(default_factory=_none_complex)
    dry: Complex = field(default_factory=_none_complex)
    still: Array = field(default_factory=_none)
    overtones: Complex = field(default_factory=_none_complex)
    together: bool = False
    hold: float = 0.0
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        omega = np.array(self.omega, dtype=np.float64)
        response = np.array(self.response, dtype=np.complex128)
        if omega.ndim != 1 or omega.size < 1 or np.any(omega <= 0) or np.any(np.diff(omega) <= 0):
            raise BadInput("A frequency response needs frequencies above 0 that increase; sort them, and leave out 0.")
        if response.shape != (omega.size, len(self.outputs)):
            raise BadInput(
                f"A response at {omega.size} frequencies of {len(self.outputs)} outputs needs shape "
                f"({omega.size}, {len(self.outputs)}), got {response.shape}."
            )
        if not np.isfinite(response).all():
            raise BadInput("A response must be finite; leave out the frequencies at which it is not known.")
        object.__setattr__(self, "omega", omega)
        object.__setattr__(self, "response", response)
        units = self.units or ("",) * (len(self.outputs) + 1)
        if len(units) != len(self.outputs) + 1:
            raise BadInput(f"{len(self.outputs)} outputs and a command need as many units, got {len(units)}.")
        object.__setattr__(self, "units", units)
        for name, default in (("variance", 0.0), ("coherence", 1.0), ("distortion", 0.0), ("dry", 0.0), ("still", 0.0)):
            kind = np.complex128 if name == "dry" else np.float64
            self._fill(name, response.shape, kind, default)
        self._fill("drive", omega.shape, np.complex128, 0.0)
        heard = np.array(self.overtones, dtype=np.complex128)
        heard = heard if heard.ndim == 3 else np.zeros((*response.shape, 0), dtype=np.complex128)
        if heard.shape[:2] != response.shape:
            raise BadInput(f"overtones of a response need shape {response.shape} and one axis more, got {heard.shape}.")
        object.__setattr__(self, "overtones", heard)

    def _fill(self, name: str, shape: tuple[int, ...], kind: Any, default: float) -> None:
        array = np.array(getattr(self, name), dtype=kind)
        value = array if array.size else np.full(shape, default, dtype=kind)
        if value.shape != shape:
            raise BadInput(f"{name} of a frequency response needs shape {shape}, got {value.shape}.")
        object.__setattr__(self, name, value)

    def __len__(self) -> int:
        return self.omega.size

    @property
    def magnitude_dB(self) -> Array:
        """Magnitude (F, n) [dB], minus infinity where an output does not move."""
        with np.errstate(divide="ignore"):
            return 20 * np.log10(np.abs(self.response))

    @property
    def states_coherence(self) -> bool:
        """Whether anybody said how much of the outputs follows the command: nothing measured follows it wholly."""
        return bool((self.coherence < 1).any())

    @property
    def error(self) -> Array:
        """Standard deviation of the relative error of the magnitude, and of the phase [rad], shape (F, n)."""
        size = np.abs(self.response)
        return np.where(size > 0, np.sqrt(self.variance / 2) / np.where(size > 0, size, 1.0), np.inf)

    def only(self, rows: ArrayLike) -> FrequencyResponse:
        """The same at some of the frequencies: a mask or indices."""
        at = np.asarray(rows)
        names = ("omega", "response", "variance", "coherence", "distortion", "drive", "dry", "still", "overtones")
        return replace(self, **{n: getattr(self, n)[at] for n in names})

    def with_scatter(self) -> FrequencyResponse:
        """The same, where nobody stated errors, with those by which neighbouring frequencies scatter."""
        scatter = np.array([_scatter(self.omega, column) for column in self.response.T])
        shares = ", ".join(f"{100 * s:.2g} %" for s in scatter)
        note = f"No errors are stated; they are taken from how neighbouring frequencies scatter, {shares}."
        return replace(self, variance=2 * (scatter * np.abs(self.response)) ** 2, notes=(*self.notes, note))

    def to_control(self) -> Any:
        """`control.FrequencyResponseData` with named signals; variances and what else was measured stay behind."""
        import control

        return control.FrequencyResponseData(
            self.response.T[:, None, :], self.omega, inputs=[self.input], outputs=list(self.outputs)
        )

    @staticmethod
    def from_control(data: Any) -> FrequencyResponse:
        """Response of a `control.FrequencyResponseData` with one input, of which only the response is known."""
        values = np.asarray(data.frdata)
        if values.shape[1] != 1:
            raise BadInput(f"One command is needed, the data has {values.shape[1]}; take them one by one.")
        return FrequencyResponse(
            omega=np.asarray(data.omega), response=values[:, 0, :].T, outputs=tuple(map(str, data.output_labels)),
            input=str(data.input_labels[0]),
        ).with_scatter()  # fmt: skip

    def to_csv(self, path: PathLike) -> None:
        """Write text that `from_csv` reads back bit for bit."""
        about = {"outputs": self.outputs, "units": self.units, "input": self.input, "together": self.together,
                 "hold": self.hold, "notes": self.notes}  # fmt: skip
        names = ["omega", "drive_re", "drive_im"]
        columns: list[Array] = [self.omega, *_parts(self.drive)]
        for j, y in enumerate(self.outputs):
            names += [f"{y}_re", f"{y}_im", f"{y}_variance", f"{y}_coherence", f"{y}_distortion", f"{y}_still"]
            names += [f"{y}_dry_re", f"{y}_dry_im"]
            columns += _parts(self.response[:, j])
            columns += [part[:, j] for part in (self.variance, self.coherence, self.distortion, self.still)]
            columns += _parts(self.dry[:, j])
            for k in range(self.overtones.shape[2]):
                names += [f"{y}_{k + 2}_re", f"{y}_{k + 2}_im"]
                columns += _parts(self.overtones[:, j, k])
        with whole_file(path) as half, open(half, "w", encoding="utf-8", newline="") as file:
            file.write(f"{MARK} 1\n# {json.dumps(about)}\n")
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(names)
            writer.writerows([repr(v) for v in row] for row in np.column_stack(columns).tolist())

    @staticmethod
    def from_csv(path: PathLike) -> FrequencyResponse:
        """Response of text written by `to_csv`."""
        try:
            file = io.StringIO(read_text(path))
            mark, about = file.readline(), file.readline()
            names = next(csv.reader([file.readline()]), [])
            if not mark.startswith(MARK):
                raise ValueError(f"it does not begin with '{MARK}'")
            table = np.loadtxt(file, delimiter=",", ndmin=2, comments=None)
            header = json.loads(about[2:])
            column = dict(zip(names, table.T, strict=True))
            outputs = tuple(str(y) for y in header["outputs"])

            def both(name: str) -> Complex:
                return column[f"{name}_re"] + 1j * column[f"{name}_im"]

            def each(name: str) -> Array:
                return np.column_stack([column[f"{y}_{name}"] for y in outputs])

            heard = sum(f"{outputs[0]}_{k}_re" in column for k in range(2, 100))
            overtones = [np.column_stack([both(f"{y}_{k + 2}") for y in outputs]) for k in range(heard)]
            return FrequencyResponse(
                overtones=np.stack(overtones, axis=2) if heard else _none_complex(),
                omega=column["omega"], response=np.column_stack([both(y) for y in outputs]), outputs=outputs,
                units=tuple(header["units"]), input=str(header["input"]), variance=each("variance"),
                coherence=each("coherence"), distortion=each("distortion"), still=each("still"), drive=both("drive"),
                dry=np.column_stack([both(f"{y}_dry") for y in outputs]), together=bool(header["together"]),
                hold=float(header["hold"]), notes=tuple(header["notes"]),
            )  # fmt: skip
        except (OSError, ValueError, KeyError, TypeError, StopIteration, RecursionError) as error:
            if isinstance(error, BadInput):
                raise
            raise BadInput(f"'{path}' must be a frequency response written by upright, but: {error}.") from None


def _scatter(omega: Array, response: Complex) -> float:
    """Relative error of real and of imaginary part, by how far each point lies off the line through its neighbours.

    The median keeps out resonances, where the response itself bends.
    """
    if omega.size < 5:
        return 0.0
    x = np.log(omega)
    y = np.column_stack([np.log(np.abs(response)), np.unwrap(np.angle(response))])
    share = ((x[1:-1] - x[:-2]) / (x[2:] - x[:-2]))[:, None]
    off = y[1:-1] - (1 - share) * y[:-2] - share * y[2:]
    return float(np.median(np.abs(off) / np.sqrt(1 + share**2 + (1 - share) ** 2))) / NORMAL


def _parts(values: Complex) -> list[Array]:
    return [np.real(values), np.imag(values)]


def is_response(path: PathLike) -> bool:
    """Whether a file is a frequency response written by `FrequencyResponse.to_csv`."""
    try:
        if not os.path.isfile(path):
            return False
        with open(path, "rb") as file:
            return file.read(len(MARK)) == MARK.encode()
    except OSError:
        return False


def describing(omega: Array, amplitude: Array) -> Complex:
    """Viscous equivalent ``4/(pi omega A)`` of unit Coulomb friction for sines of amplitude A (F, n) at omega (F,)."""
    speed = np.abs(omega)[:, None] * np.abs(amplitude)
    return np.asarray(4 / (math.pi * np.maximum(speed, 1e-300)), dtype=np.complex128)
