"""Where does the compiled kernel come from the second time?

The text of a kernel is written once into the user's cache folder, under the hash of its content and of the compiler's
versions, and imported from there, so that Numba's own cache finds the machine code again; Numba itself asks whether the
processor is the same. A changed plant is another text, so nothing can go stale.
"""

from __future__ import annotations

import atexit
import hashlib
import importlib.util
import os
import shutil
import sys
import tempfile
from functools import cache
from pathlib import Path
from types import ModuleType

from upright.simulation.kernel.flavour import Layout
from upright.simulation.kernel.source import source


@cache
def kernel(p: Layout) -> ModuleType:
    """Compiled kernel of a plant in a flavour, from the cache when it has been there before."""
    text = source(p)
    name = called(text)
    path = written(folder() / f"{name}.py", text)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None  # a .py file always has a loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def called(text: str) -> str:
    """Name of the module with this text."""
    import llvmlite
    import numba

    digest = hashlib.sha256(f"{numba.__version__} {llvmlite.__version__}\n{text}".encode()).hexdigest()[:20]
    return f"upright_kernel_{digest}"


@cache
def folder() -> Path:
    """Folder of the kernels: ``UPRIGHT_CACHE``, else the user's cache folder, else one among temporary files."""
    from platformdirs import user_cache_dir

    places = [os.environ.get("UPRIGHT_CACHE"), user_cache_dir("upright"), _temporary()]
    for place in filter(None, places):
        path = Path(place) / "kernels"
        try:
            path.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=path):
                return path
        except OSError:
            continue
    passing = tempfile.mkdtemp(prefix="upright-")
    atexit.register(shutil.rmtree, passing, ignore_errors=True)
    return Path(passing)


def _temporary() -> str | None:
    """A folder among temporary files that only this user can write to, since code is run from it; or none."""
    if not hasattr(os, "getuid"):  # elsewhere the folder of temporary files is the user's own
        return os.path.join(tempfile.gettempdir(), "upright")
    path = Path(tempfile.gettempdir()) / f"upright-{os.getuid()}"
    try:
        path.mkdir(mode=0o700, exist_ok=True)
        found = path.lstat()
    except OSError:
        return None
    ours = found.st_uid == os.getuid() and not found.st_mode & 0o022 and not path.is_symlink()
    return str(path) if ours else None


def written(path: Path, text: str) -> Path:
    """File with this text: left alone where it is right, else written aside and moved, so that none sees half of it.

    Several processes may do so at once. Its time stamp is fixed, because Numba's cache takes a newer one for a change.
    """
    if _holds(path, text):
        return path
    with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".tmp", delete=False, encoding="utf-8") as file:
        file.write(text)
    try:
        os.utime(file.name, (1e9, 1e9))
        os.replace(file.name, path)
    except OSError:
        # Windows refuses while another process, which wrote the same, has the file open
        os.unlink(file.name)
        if not _holds(path, text):
            raise
    return path


def _holds(path: Path, text: str) -> bool:
    try:
        return path.read_text(encoding="utf-8") == text
    except (OSError, UnicodeDecodeError):
        return False
