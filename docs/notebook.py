"""How does a notebook come to its outputs? Its cells run in order in one namespace, as Jupyter would, but without it.

The outputs stored are those a cell's last value offers (a picture, a formula, a table) and what it printed; nothing in
them tells where, when or on which machine they were made.
"""

from __future__ import annotations

import ast
import base64
import io
import json
import os
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import chdir, redirect_stdout
from pathlib import Path
from typing import Any

WIDTH = 720  # pixels of a picture on the page
_SHARP = 1.25  # stored pixels to one on the page
_COLOURS = 80
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_LANGUAGE = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}

Cell = dict[str, Any]
Notebook = dict[str, Any]


class CellFailed(Exception):
    """A cell that raised; says which, and shows its source."""


def read(path: Path) -> Notebook:
    """Notebook of a file."""
    return json.loads(path.read_text(encoding="utf-8"))


def write(path: Path, notebook: Notebook) -> None:
    """Write a notebook as Jupyter does, so that both leave the same file."""
    text = json.dumps(notebook, indent=1, ensure_ascii=False, sort_keys=True)
    path.write_text(text + "\n", encoding="utf-8")


def executed(notebook: Notebook) -> Notebook:
    """The same notebook with fresh outputs; files it writes go to a folder that is gone afterwards.

    Raises
    ------
    CellFailed
        When a cell raises.
    """
    os.environ["MPLBACKEND"] = "Agg"
    cells: list[Cell] = []
    outputs: list[dict[str, Any]] = []
    scope: dict[str, Any] = {
        "__name__": "__main__",
        "display": lambda value: outputs.append(_shown(value)),
    }
    count = 0
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        for i, cell in enumerate(notebook["cells"]):
            fresh = {
                "cell_type": cell["cell_type"],
                "id": f"cell-{i + 1}",
                "metadata": {},
                "source": cell["source"],
            }
            if cell["cell_type"] == "code":
                count += 1
                outputs.clear()
                _run("".join(cell["source"]), scope, outputs, count)
                fresh |= {"execution_count": count, "outputs": [dict(o) for o in outputs]}
            cells.append(fresh)
    return {"cells": cells, "metadata": _LANGUAGE, "nbformat": 4, "nbformat_minor": 5}


def _run(source: str, scope: dict[str, Any], outputs: list[dict[str, Any]], count: int) -> None:
    """Run one cell: what it prints, then what it drew, then its last value, each appended to `outputs`."""
    body = ast.parse(source).body
    last = body.pop() if body and isinstance(body[-1], ast.Expr) else None
    said = io.StringIO()
    try:
        with redirect_stdout(said):
            exec(compile(ast.Module(body, []), f"<cell {count}>", "exec"), scope)
            value = (
                eval(compile(ast.Expression(last.value), f"<cell {count}>", "eval"), scope)
                if last
                else None
            )
    except Exception as error:
        raise CellFailed(
            f"cell {count} raises {type(error).__name__}: {error}\n\n{source}"
        ) from error
    if said.getvalue():
        outputs.insert(
            0, {"name": "stdout", "output_type": "stream", "text": _lines(said.getvalue())}
        )
    outputs += [_shown(drawing) for drawing in _drawn()]
    if value is not None:
        outputs.append({**_shown(value), "execution_count": count, "output_type": "execute_result"})


def _drawn() -> list[Any]:
    """Figures that pyplot holds open, which are closed."""
    from matplotlib import pyplot

    figures = [pyplot.figure(number) for number in pyplot.get_fignums()]
    pyplot.close("all")
    return figures


def _shown(value: Any) -> dict[str, Any]:
    """Output of a value in the richest form it has."""
    from matplotlib.figure import Figure

    data: dict[str, Any] = {}
    metadata: dict[str, Any] = {}
    if isinstance(value, Figure):
        told = _told(value)
        data["image/png"] = _png(value)
        metadata["image/png"] = {
            "alt": told,
            "width": round(WIDTH * min(1.0, value.get_figwidth() / 7.4)),
        }
        data["text/plain"] = [told]
    else:
        for kind, method in (
            ("text/html", "_repr_html_"),
            ("text/markdown", "_repr_markdown_"),
            ("text/latex", "_repr_latex_"),
        ):
            form: Callable[[], str | None] | None = getattr(value, method, None)
            text = form() if form and not isinstance(value, type) else None
            if text:
                data[kind] = _lines(text)
        data["text/plain"] = ["a formula or table"] if data else _lines(repr(value))
    return {"data": data, "metadata": metadata, "output_type": "display_data"}


def _png(drawing: Any) -> str:
    """Base64 of a picture in few colours, which is all that curves and labels need."""
    from PIL import Image

    raw = io.BytesIO()
    drawing.savefig(raw, format="png", dpi=_SHARP * WIDTH / 7.4, facecolor="white")
    few = (
        Image.open(raw)
        .convert("RGB")
        .quantize(_COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    )
    small = io.BytesIO()
    few.save(small, format="png", optimize=True)
    return base64.b64encode(small.getvalue()).decode("ascii") + "\n"


def _told(drawing: Any) -> str:
    """What a picture shows, for who cannot see it: titles, and what is drawn over what."""
    panels: list[str] = []
    for axes in drawing.axes:
        titles = (axes.get_title(loc) for loc in ("left", "center", "right"))
        over = (
            " over ".join(filter(None, (axes.get_ylabel(), axes.get_xlabel())))
            if axes.axison
            else ""
        )
        panels.append(": ".join(filter(None, (", ".join(filter(None, titles)), over))))
    words = "; ".join(dict.fromkeys(filter(None, panels))) or "a drawing"
    return "Picture. " + " ".join(re.sub(r"\\math\w+|[${}\\]", "", words).split())


def _lines(text: str) -> list[str]:
    return text.splitlines(keepends=True)


def differences(stored: Notebook, fresh: Notebook) -> Iterator[str]:
    """Sentences about cells that no longer say what is stored.

    A number printed was rounded, so its last digit may differ by one; pictures and formulas are only asked to be there.
    """
    for a, b in zip(stored["cells"], fresh["cells"], strict=True):
        if a["cell_type"] != "code":
            continue
        where, before, now = (
            f"cell {b['execution_count']}",
            _said(a["outputs"]),
            _said(b["outputs"]),
        )
        if [kinds for kinds, _ in before] != [kinds for kinds, _ in now]:
            yield f"{where} shows other kinds of things than are stored."
            continue
        for (_, one), (_, other) in zip(before, now, strict=True):
            if not alike(one, other):
                yield f"{where} says\n{other}\nand what is stored is\n{one}"


def _said(outputs: list[dict[str, Any]]) -> list[tuple[list[str], str]]:
    """Kinds and text of each output; what was printed is one, in how many pieces it may have come."""
    said: list[tuple[list[str], str]] = []
    for output in outputs:
        kinds = sorted(output.get("data", {}))
        if said and not kinds and not said[-1][0]:
            said[-1] = ([], said[-1][1] + _text(output))
        else:
            said.append((kinds, _text(output)))
    return said


def _text(output: dict[str, Any]) -> str:
    if len(output.get("data", "?")) > 1:
        return ""  # a picture or a formula
    return "".join(output.get("text") or output["data"]["text/plain"])


def alike(stored: str, fresh: str) -> bool:
    """Do two texts say the same, with numbers that differ by no more than one in their last digit?"""
    if " ".join(_NUMBER.sub("#", stored).split()) != " ".join(_NUMBER.sub("#", fresh).split()):
        return False
    pairs = zip(_NUMBER.findall(stored), _NUMBER.findall(fresh), strict=True)
    return all(
        abs(float(a) - float(b)) <= 1.001 * max(_last_digit(a), _last_digit(b)) for a, b in pairs
    )


def _last_digit(number: str) -> float:
    """Worth of the last digit: 0.01 for 3.14, 1e-5 for 2.17e-3."""
    mantissa, _, power = number.partition("e")
    return 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
