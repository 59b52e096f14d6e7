"""What one imports to fit a rig is there, and costs nothing until it is used."""

from __future__ import annotations

import subprocess
import sys

import pytest

import upright.identification as identification


@pytest.mark.parametrize("name", identification.__all__)
def test_public_name_is_there(name: str) -> None:
    assert getattr(identification, name) is not None
    assert name in dir(identification)


def test_unknown_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="identfy"):
        _ = identification.identfy  # pyright: ignore


def test_package_alone_imports_no_numbers() -> None:
    code = "import sys, upright.identification; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
