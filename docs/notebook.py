"""Outputs of a notebook, made afresh by nbclient, and what they say that is not stored.

Nothing in what is stored tells where, when or on which machine it was made.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
from collections.abc import Iterator
from typing import Any

import nbformat
from nbclient import NotebookClient
from nbclient.exceptions import CellExecutionError
from nbformat import NotebookNode

_RICH = {"text/html", "text/markdown", "text/latex"}
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
_LANGUAGE = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}


class CellFailed(Exception):
    """A cell that raised; says which, and shows its source."""


def executed(notebook: NotebookNode) -> NotebookNode:
    """The same notebook with fresh outputs; files it writes go to a folder that is gone afterwards.

    Raises
    ------
    CellFailed
        When a cell raises.
    """
    make = {"code": nbformat.v4.new_code_cell, "markdown": nbformat.v4.new_markdown_cell}
    cells = [
        make[cell.cell_type](cell.source, id=f"cell-{i}")
        for i, cell in enumerate(notebook.cells, start=1)
    ]
    fresh = nbformat.v4.new_notebook(cells=cells)
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(map(os.path.abspath, sys.path)),  # `docs.pictures` too
        "MPLBACKEND": "module://matplotlib_inline.backend_inline",
        # a debugger's word about itself and those of libraries about encodings are no output of a cell
        "PYDEVD_DISABLE_FILE_VALIDATION": "1",
        "PYTHONWARNDEFAULTENCODING": "",
    }
    with tempfile.TemporaryDirectory() as folder:
        client = NotebookClient(
            fresh,
            kernel_name="python3",
            resources={"metadata": {"path": folder}},
            extra_arguments=["--IPKernelApp.extra_extensions=docs.pictures", "--log-level=ERROR"],
            coalesce_streams=True,
            record_timing=False,
        )
        try:
            client.execute(env=environment)
        except CellExecutionError as error:
            cell = next(
                c
                for c in fresh.cells
                if any(o.output_type == "error" for o in c.get("outputs", ()))
            )
            raise CellFailed(
                f"cell {cell.execution_count} raises {error.ename}: {error.evalue}\n\n{cell.source}"
            ) from error
    for output in (o for cell in fresh.cells for o in cell.get("outputs", ())):
        if _RICH & output.get("data", {}).keys():
            output.data["text/plain"] = "a formula or table"
    fresh.metadata = nbformat.from_dict(_LANGUAGE)
    return fresh


def differences(stored: NotebookNode, fresh: NotebookNode) -> Iterator[str]:
    """Sentences about cells that no longer say what is stored.

    A number printed was rounded, so its last digit may differ by one; pictures and formulas are only asked to be there.
    """
    for a, b in zip(stored.cells, fresh.cells, strict=True):
        if a.cell_type != "code":
            continue
        where, before, now = f"cell {b.execution_count}", _said(a.outputs), _said(b.outputs)
        if [kinds for kinds, _ in before] != [kinds for kinds, _ in now]:
            yield f"{where} shows other kinds of things than are stored."
            continue
        for (_, one), (_, other) in zip(before, now, strict=True):
            if not alike(one, other):
                yield f"{where} says\n{other}\nand what is stored is\n{one}"


def _said(outputs: list[Any]) -> list[tuple[list[str], str]]:
    """Kinds and text of each output; what was printed is one, in how many pieces it may have come."""
    said: list[tuple[list[str], str]] = []
    for output in outputs:
        kinds = sorted(output.get("data", ()))
        text = output.data["text/plain"] if kinds == ["text/plain"] else output.get("text", "")
        if said and not kinds and not said[-1][0]:
            said[-1] = ([], said[-1][1] + text)
        else:
            said.append((kinds, text))
    return said


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
