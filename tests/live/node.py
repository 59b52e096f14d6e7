"""Runs scripts of the package in Node, as a page would."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

NODE = shutil.which("node")
needs_node = pytest.mark.skipif(NODE is None, reason="Node is missing")


def in_node(scripts: list[Path], body: str, given: Any) -> Any:
    """What `body` puts into `result`, after the scripts; `given` is what it is handed."""
    assert NODE is not None
    whole = "\n".join(
        [
            *(path.read_text(encoding="utf-8") for path in scripts),
            "const given = JSON.parse(require('fs').readFileSync(0, 'utf8')); let result;",
            body,
            "process.stdout.write(JSON.stringify(result));",
        ]
    )
    finished = subprocess.run(
        [NODE, "-e", whole], input=json.dumps(given, allow_nan=False), capture_output=True, text=True, check=False
    )
    assert finished.returncode == 0, finished.stderr[-2000:]
    return json.loads(finished.stdout)
