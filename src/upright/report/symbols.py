"""How names, numbers and units of the program are written for a person: as text, for matplotlib, in MathML."""

from __future__ import annotations

import math
import re
import shlex
from functools import cache
from html import escape
from pathlib import Path

from upright.quantities import figures

_LETTERS = (
    "alpha beta gamma delta epsilon zeta eta theta iota kappa lambda mu nu xi omicron pi rho sigmaf sigma tau upsilon"
    " phi chi psi omega"
)
GREEK = {name: chr(code) for code, name in enumerate(_LETTERS.split(), start=0x3B1)}
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_SYMBOL = re.compile(r"[A-Za-z]+[0-9]*(_[A-Za-z0-9]+)*\Z")


def parts(name: str) -> tuple[str, str, str]:
    """Stem, subscript and dot of a symbol: ``theta1_dot`` -> ``θ``, ``1``, ``.``; ``b_1c`` -> ``b``, ``1c``."""
    dot = "." if name.endswith("_dot") else ""
    stem, _, below = name.removesuffix("_dot").partition("_")
    digits = re.fullmatch(r"([A-Za-z]+)([0-9]+)", stem)
    if digits and not below:
        stem, below = digits.groups()
    return GREEK.get(stem, stem), GREEK.get(below, below).replace("_", ","), dot


@cache
def identifier(name: str, power: str = "") -> str:
    """MathML of a symbol: ``theta_ddot`` -> theta with two dots; ``b_1c`` -> b with a subscript."""
    twice = name.endswith("_ddot")
    stem, below, dot = parts(name.replace("_ddot", "_dot"))
    upright = ' mathvariant="normal"' if len(stem) > 1 else ""
    out = f"<mi{upright}>{escape(stem)}</mi>"
    if dot:
        # not as an accent: browsers without a mathematical font would draw the dots into the letter
        out = f"<mover>{out}<mo>{'¨' if twice else '˙'}</mo></mover>"
    below = f"<mtext>{escape(below)}</mtext>" if below else ""
    if below and power:
        return f"<msubsup>{out}{below}{power}</msubsup>"
    if power:
        return f"<msup>{out}{power}</msup>"
    return f"<msub>{out}{below}</msub>" if below else out


def symbol(name: str) -> str:
    """MathML of a parameter's or signal's name, to stand in a sentence or a table."""
    if not name.replace("_", "").isalnum():
        return f"<span>{escape(name)}</span>"
    return f"<math><mrow>{identifier(name)}</mrow></math>"


def slanted(name: str) -> str:
    """HTML of a parameter's or signal's name, its stem slanted, its subscript upright; all of it is text."""
    if not name.replace("_", "").isalnum():
        return f"<span>{escape(name)}</span>"
    stem, below, dot = parts(name)
    below = f"<sub>{escape(below)}</sub>" if below else ""
    return f"<i>{escape(stem)}{chr(0x307) if dot else ''}{below}</i>"


def plain(name: str) -> str:
    """Symbol as text: ``theta_dot`` -> ``θ̇``, ``b_1c`` stays as the study file spells it."""
    stem, below, dot = parts(name)
    return f"{stem}{chr(0x307) if dot else ''}{below}" if dot or not below or name[-1:].isdigit() else name


def mathtext(name: str) -> str:
    """Symbol for matplotlib: ``b_1c`` -> ``$b_{1c}$``; what is no symbol comes back with its dollars escaped."""
    if not _SYMBOL.match(name):
        return name.replace("$", r"\$")
    stem, below, dot = parts(name)
    stem = rf"\mathrm{{{stem}}}" if len(stem) > 1 else stem
    stem = rf"\dot{{{stem}}}" if dot else stem
    return f"${stem}_{{\\mathrm{{{below}}}}}$" if below else f"${stem}$"


def unit(text: str) -> str:
    """Unit with raised powers: ``kg m^2`` -> ``kg m²``; a pure number has none."""
    raised = re.sub(r"(?:\^|\*\*)(-?[0-9]+)", lambda m: m[1].translate(_SUPERSCRIPT), text)
    return "" if raised in ("1", "") else raised.replace("*", "·")


def axis(symbol: str, of: str) -> str:
    """Axis label: ``θ [rad]``."""
    return f"{symbol} [{unit(of)}]" if unit(of) else symbol


def number(value: float, digits: int = 4) -> str:
    """Number with `digits` significant figures, powers of ten written out: ``1.6·10⁻³``."""
    if math.isnan(value):
        return "not known"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(abs(value)))
    if -3 < exponent < 6:
        text = f"{value:.{max(0, digits - 1 - exponent)}f}"
        return text.replace("-", "−")
    mantissa, power = f"{value:.{digits - 1}e}".split("e")
    return f"{mantissa}·10{str(int(power)).translate(_SUPERSCRIPT)}".replace("-", "−")


def with_error(value: float, stderr: float) -> tuple[str, str]:
    """Value and its standard error, to the two figures of the error that mean something."""
    return number(value, figures(value, stderr)), number(stderr, 2) if stderr > 0 else "–"


def percent(value: float) -> str:
    """Fit percent; one figure after the point, two above 99."""
    if not math.isfinite(value):
        return number(value)
    return f"{value:.2f} %" if value > 99 else f"{value:.1f} %".replace("-", "−")


def typed(path: Path | str) -> str:
    """A path as it is typed on a command line: in quotes when it holds blanks or what a shell would read."""
    text = str(path)
    if re.fullmatch(r"[\w./\\:~+=@%,-]+", text):
        return text
    return shlex.quote(text) if re.search(r"[\"$`!]", text) else f'"{text}"'
