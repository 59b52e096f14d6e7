"""The unit as a file: description, sources and, where there is a compiler, the library for this machine."""

from __future__ import annotations

import hashlib
import io
import platform
import shutil
import subprocess
import tempfile
import uuid
import zipfile
from pathlib import Path
from xml.sax.saxutils import quoteattr

from upright._version import __version__
from upright.errors import BadInput
from upright.exports.controller import harmless
from upright.exports.fmu.source import fmu_source
from upright.exports.fmu.unit import STEP, Unit, Variable
from upright.exports.texts import filled

NAME = "rig"
_ENDINGS = {"Linux": ("linux", "so"), "Darwin": ("darwin", "dylib"), "Windows": ("windows", "dll")}


def archive(unit: Unit) -> tuple[bytes, str]:
    """Bytes of the archive, and the platform that its library is for; "" where no C compiler is found."""
    text = fmu_source(unit, "{TOKEN}")
    token = "{" + str(uuid.uuid5(uuid.NAMESPACE_URL, hashlib.sha256(text.encode()).hexdigest())) + "}"
    text = text.replace("{TOKEN}", token)
    files = {
        "modelDescription.xml": model_description(unit, token).encode(),
        f"sources/{NAME}.c": text.encode(),
        "sources/buildDescription.xml": filled("buildDescription.xml.in", identifier=NAME).encode(),
    }
    library = compiled_library(text)
    system, ending = _ENDINGS.get(platform.system(), ("", ""))
    where = f"{_machine()}-{system}"
    if library is not None:
        files[f"binaries/{where}/{NAME}.{ending}"] = library
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), content, zipfile.ZIP_DEFLATED)
    return held.getvalue(), where if library is not None else ""


def compiled_library(text: str) -> bytes | None:
    """The library, None where there is no C compiler.

    Raises
    ------
    BadInput
        When there is one and it fails.
    """
    compiler = next((c for c in ("cc", "gcc", "clang") if shutil.which(c)), None)
    if compiler is None or platform.system() not in _ENDINGS:
        return None
    with tempfile.TemporaryDirectory() as folder:
        file, library = Path(folder) / f"{NAME}.c", Path(folder) / NAME
        file.write_text(text, encoding="utf-8")
        options = ["-std=c99", "-O2", "-shared", "-fPIC", "-fvisibility=hidden"]
        compiled = subprocess.run(
            [compiler, *options, str(file), "-o", str(library), "-lm"], capture_output=True, check=False
        )  # fmt: skip
        if compiled.returncode:
            message = (compiled.stderr.decode(errors="replace").strip() or "no message").splitlines()[0]
            raise BadInput(
                f"the C compiler {compiler} failed on the unit's library: {message}; does it compile other programs?"
            )
        return library.read_bytes()


def _machine() -> str:
    machine = platform.machine().lower()
    return {"amd64": "x86_64", "arm64": "aarch64"}.get(machine, machine)


def model_description(unit: Unit, token: str) -> str:
    """Text of ``modelDescription.xml``."""
    first_line = harmless(unit.rig.basis.first_line())
    description = f" description={quoteattr(first_line)}" if first_line else ""
    variables = [
        '    <Float64 name="time" valueReference="0" causality="independent" variability="continuous" unit="s"/>'
    ]
    outputs: list[str] = []
    for number, v in enumerate([*unit.inputs, *unit.states, *unit.starts, *unit.parameters], start=1):
        variables.append(_variable(v, number))
        outputs += [str(number)] if v.causality == "output" else []
    units = sorted({v.unit for v in [*unit.inputs, *unit.states, *unit.parameters] if v.unit} | {"s"})
    structure = [f'    <{kind} valueReference="{n}"/>' for kind in ("Output", "InitialUnknown") for n in outputs]
    return filled(
        "modelDescription.xml.in", name=quoteattr(unit.rig.name), token=token, identifier=NAME, version=__version__,
        step=repr(STEP), description=description, units="\n".join(f"    <Unit name={quoteattr(u)}/>" for u in units),
        experiment_step=repr(10 * STEP), variables="\n".join(variables), structure="\n".join(structure),
    )  # fmt: skip


def _variable(v: Variable, number: int) -> str:
    about = f'name={quoteattr(v.name)} valueReference="{number}" description={quoteattr(v.meaning)}'
    about += f" unit={quoteattr(v.unit)}" if v.unit else ""
    kind = {
        "input": f'causality="input" variability="continuous" start="{v.value!r}"',
        "output": 'causality="output" variability="continuous" initial="calculated"',
        "parameter": f'causality="parameter" variability="fixed" initial="exact" start="{v.value!r}"',
    }[v.causality]
    return f"    <Float64 {about} {kind}/>"
