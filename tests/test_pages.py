"""Does the Python on the pages run, as it stands there, from top to bottom of each page?"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from docs import reference

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"^```python\n(.*?)^```", re.M | re.S)
ELSEWHERE = ("# python-control", "# lmfit", "# TCLab")
"""First lines of what another tool would be given."""


def blocks(page: Path) -> list[str]:
    return [b for b in BLOCK.findall(page.read_text(encoding="utf-8")) if not b.startswith(ELSEWHERE)]


def complete(page: Path) -> bool:
    """Whether a page's Python is a session; elsewhere blocks are excerpts."""
    return "import upright as up" in "".join(blocks(page))


DOCS = [page for page in sorted((ROOT / "docs").rglob("*.md")) if "_build" not in page.parts]
PAGES = [page for page in (ROOT / "README.md", *DOCS) if complete(page)]


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_python_of_a_page_runs(page, tmp_path, monkeypatch, capsys):
    """As cells of a notebook would: a block that defines a class of a file is that file."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    text = page.read_text(encoding="utf-8")
    named = re.findall(r"^Save this as `(\w+\.py)`", text, re.M)
    namespace: dict[str, object] = {}
    if '"swing.csv"' in text and "to_csv" not in text:  # the reader's log
        exec(reference.examples()["set-up"], {})
    for number, block in enumerate(blocks(page)):
        file = tmp_path / (named[0] if named and number == 0 else f"block_{number}.py")
        file.write_text(block, encoding="utf-8")
        exec(compile(block, str(file), "exec"), namespace)
    if page.stem == "friction":
        assert capsys.readouterr().out.split() == ["False", "True"]
