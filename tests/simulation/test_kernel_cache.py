"""Is a kernel compiled once, whoever else compiles it at the same time and wherever it may be kept?"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numba
import numpy as np
import pytest

from tests.simulation.conftest import BLOCK
from upright.simulation import choose, simulate
from upright.simulation.kernel.compiled import called, folder, kernel, written
from upright.simulation.kernel.flavour import Layout

MOTION = """
from upright.physics import chain
from upright.simulation import choose, simulate
from upright.simulation.kernel.compiled import kernel
from upright.simulation.kernel.flavour import Layout

plant, values = chain(1)(m_1=1.0, k_1=20.0), {friction}
x = simulate(plant, values, [0.3, 0.0], None, 0.01, samples=101)
print(repr(float(x[-1, 0, 0])))
derived = plant.derived_for({{**plant.parameters(), **values}})
used = kernel(Layout(derived=derived, flavour=choose(derived, {{**plant.parameters(), **values}})))
print(sum(used.run_1.stats.cache_hits.values()), sum(used.run_1.stats.cache_misses.values()))
print(used.events.cache_hits if values else 1)
"""


def process(cache, *, friction=False):
    """A Python that simulates one motion with its kernels in the folder `cache`."""
    environment = dict(os.environ, UPRIGHT_CACHE=str(cache))
    environment.pop("NUMBA_CACHE_DIR", None)
    text = MOTION.format(friction={"f_1c": 0.5} if friction else {})
    return subprocess.Popen(
        [sys.executable, "-c", text], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8"
    )


def answer(running):
    """Last position, hits, misses and hits of the search of events."""
    out, err = running.communicate(timeout=300)
    assert running.returncode == 0, err
    x, run, events = out.splitlines()
    return x, *map(int, run.split()), int(events)


@pytest.mark.parametrize("friction", [False, True])
def test_a_second_process_finds_the_machine_code_of_the_first(tmp_path, friction):
    first, hits, misses, _ = answer(process(tmp_path, friction=friction))
    assert (hits, misses) == (0, 1)
    second, hits, misses, events = answer(process(tmp_path, friction=friction))
    assert (hits, misses, events) == (1, 0, 1)
    assert second == first


@pytest.mark.slow
def test_processes_that_compile_the_same_kernel_at_once_all_succeed(tmp_path):
    answers = [answer(p) for p in [process(tmp_path, friction=True) for _ in range(4)]]
    assert len({a[0] for a in answers}) == 1
    assert answer(process(tmp_path, friction=True))[1:] == (1, 0, 1)
    assert not list(tmp_path.rglob("*.tmp*"))


@pytest.fixture
def fresh_folder(monkeypatch, tmp_path):
    """As in a process that has not yet looked for a folder, with temporary files below `tmp_path`."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    folder.cache_clear()
    yield tmp_path
    folder.cache_clear()


def nowhere_to_write(monkeypatch, tmp_path):
    """Every folder of the user lies below a file: not even root may write there."""
    (tmp_path / "file").write_text("", encoding="utf-8")
    for name in ("UPRIGHT_CACHE", "HOME", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.setenv(name, str(tmp_path / "file" / "below"))


def test_without_a_writable_folder_of_the_user_kernels_are_kept_among_temporary_files(monkeypatch, fresh_folder, block):
    nowhere_to_write(monkeypatch, fresh_folder)
    assert fresh_folder in folder().parents
    again = folder()
    folder.cache_clear()
    assert folder() == again  # the next process finds it too
    x = simulate(block, BLOCK, [0.0, 1.0], None, 0.5, samples=3)
    assert np.array_equal(x[:, 0, 0], [0.0, 0.5, 1.0])


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="temporary files are the user's own here")
def test_code_is_not_run_from_a_temporary_folder_that_others_can_write_to(monkeypatch, fresh_folder):
    nowhere_to_write(monkeypatch, fresh_folder)
    planted = folder().parent
    planted.chmod(0o777)
    folder.cache_clear()
    assert planted not in folder().parents
    assert fresh_folder in folder().parents


def test_a_damaged_file_is_written_again(tmp_path):
    path = written(tmp_path / "kernel.py", "a = 1\n")
    path.write_text("a =", encoding="utf-8")
    before = path.stat().st_mtime
    assert written(path, "a = 1\n").read_text(encoding="utf-8") == "a = 1\n"
    assert path.stat().st_mtime < before  # its fixed stamp again, by which Numba knows it
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("other", ["a = 1\n", "a ="])
def test_a_file_that_cannot_be_replaced_will_do_if_it_says_the_same(monkeypatch, tmp_path, other):
    path = tmp_path / "kernel.py"

    def refused(source, target):
        Path(target).write_text(other, encoding="utf-8")  # another process was faster and still has it open
        raise PermissionError(13, "the file is in use", str(target))

    monkeypatch.setattr(os, "replace", refused)
    if other == "a = 1\n":
        assert written(path, "a = 1\n") == path
    else:
        with pytest.raises(PermissionError):
            written(path, "a = 1\n")
    assert list(tmp_path.iterdir()) == [path]


def test_every_kind_of_array_and_number_meets_the_same_machine_code(block):
    # two signatures compiled at once by two processes could swap places in Numba's cache
    flavour = choose(block, BLOCK)
    u = np.linspace(0.0, 1.0, 20)
    locked = u.copy()
    locked.setflags(write=False)
    paths = []
    for given in (u, locked, u.reshape(20, 1), np.repeat(u, 2)[::2], u[:, None].astype(">f8"), list(u)):
        for count in (21, np.int32(21)):
            paths.append(simulate(block, BLOCK, np.zeros(2, np.float32), given, np.float64(0.01), samples=count))
    assert all(np.array_equal(paths[0], path) for path in paths)
    assert len(kernel(Layout(derived=block, flavour=flavour)).run_1.signatures) == 1


def test_another_version_of_the_compiler_gets_another_file(monkeypatch):
    now = called("text")
    monkeypatch.setattr(numba, "__version__", "0.0")
    assert called("text") != now
