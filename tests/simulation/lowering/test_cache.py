"""Is machine code compiled once, whoever else compiles it meanwhile, and only ever loaded if this user wrote it?"""

from __future__ import annotations

import errno
import os
import subprocess
import sys

import numpy as np
import pytest

from tests.simulation.conftest import BLOCK
from upright.simulation import choose, simulate
from upright.simulation.kernel.compiled import Kernel, source
from upright.simulation.kernel.flavour import Layout
from upright.simulation.lowering import cache

MOTION = """
from upright.physics import chain
from upright.simulation import choose, simulate
from upright.simulation.kernel.compiled import kernel
from upright.simulation.kernel.flavour import Layout

plant, values = chain(1)(m_1=1.0, k_1=20.0), {friction}
x = simulate(plant, values, [0.3, 0.0], None, 0.01, samples=101)
print(repr(float(x[-1, 0, 0])))
derived = plant.derived_for({{**plant.parameters(), **values}})
print(*kernel(Layout(derived=derived, flavour=choose(derived, {{**plant.parameters(), **values}}))).compiled)
"""


def process(cache, *, friction=False):
    """A Python that simulates one motion with its machine code in the folder `cache`."""
    environment = dict(os.environ, UPRIGHT_CACHE=str(cache))
    text = MOTION.format(friction={"f_1c": 0.5} if friction else {})
    return subprocess.Popen(
        [sys.executable, "-c", text], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8"
    )


def answer(running):
    """Last position, and the functions that had to be compiled."""
    out, err = running.communicate(timeout=300)
    assert running.returncode == 0, err
    x, compiled = out.split("\n")[:2]
    return x, compiled.split()


@pytest.mark.parametrize("friction", [False, True])
def test_a_second_process_finds_the_machine_code_of_the_first(tmp_path, friction):
    first, compiled = answer(process(tmp_path, friction=friction))
    assert compiled == ["run_1", "events"][: 1 + friction]
    assert answer(process(tmp_path, friction=friction)) == (first, [])


@pytest.mark.slow
def test_processes_that_compile_the_same_kernel_at_once_all_succeed(tmp_path):
    answers = [answer(p) for p in [process(tmp_path, friction=True) for _ in range(4)]]
    assert len({x for x, _ in answers}) == 1
    assert answer(process(tmp_path, friction=True)) == (answers[0][0], [])
    assert not list(tmp_path.rglob("*.tmp*"))


@pytest.fixture
def fresh(monkeypatch, tmp_path):
    """A cache folder of one's own, as in a process that has not looked for one."""
    monkeypatch.setenv("UPRIGHT_CACHE", str(tmp_path))
    cache.cache_folder.cache_clear()
    yield tmp_path / "code"
    cache.cache_folder.cache_clear()


@pytest.fixture
def only(fresh):
    """The file that holds the only code kept."""
    cache.keep_code("name", b"code")
    (path,) = fresh.iterdir()
    return path


def test_what_was_written_is_read_again(only):
    assert cache.cached_code("name") == b"code"


@pytest.mark.parametrize("change", [b"", b"co", bytes(36)])
def test_a_torn_file_is_not_loaded_and_is_written_again(only, change):
    only.write_bytes(change)
    assert cache.cached_code("name") is None
    cache.keep_code("name", b"code")
    assert cache.cached_code("name") == b"code"


def test_code_under_another_name_is_not_loaded(only):
    os.replace(only, only.with_name("other"))
    assert cache.cached_code("other") is None


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="here nobody else can write to a user's profile")
class TestOthers:
    def test_the_folder_is_for_its_owner_only(self, fresh):
        assert cache.cache_folder() == fresh
        assert fresh.stat().st_mode & 0o077 == 0

    def test_a_folder_that_others_can_write_to_is_closed_to_them(self, fresh):
        fresh.mkdir()
        fresh.chmod(0o777)
        assert cache.cache_folder() == fresh
        assert fresh.stat().st_mode & 0o022 == 0

    def test_a_file_that_others_can_write_to_is_not_loaded(self, only):
        only.chmod(0o666)
        assert cache.cached_code("name") is None

    def test_a_file_of_somebody_else_is_not_loaded(self, only, monkeypatch):
        nobody = os.getuid() + 1
        monkeypatch.setattr(os, "getuid", lambda: nobody)
        assert cache.cached_code("name") is None

    def test_neither_is_a_folder_of_somebody_else_used(self, fresh, monkeypatch):
        fresh.mkdir()
        nobody = os.getuid() + 1
        monkeypatch.setattr(os, "getuid", lambda: nobody)
        monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(fresh.parent))
        assert cache.cache_folder() is None

    def test_a_link_is_not_followed(self, only):
        os.replace(only, only.with_name("elsewhere"))
        only.symlink_to(only.with_name("elsewhere"))
        assert cache.cached_code("name") is None


def test_without_a_folder_to_write_to_motions_are_simulated_all_the_same(monkeypatch, tmp_path, block):
    # below a file not even root may write
    (tmp_path / "file").write_text("", encoding="utf-8")
    for name in ("UPRIGHT_CACHE", "HOME", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.setenv(name, str(tmp_path / "file" / "below"))
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(tmp_path / "file" / "below"))
    cache.cache_folder.cache_clear()
    try:
        assert cache.cache_folder() is None
        layout = Layout(derived=block, flavour=choose(block, {**BLOCK, "F_c": 0.1}))
        assert Kernel(source(layout)).events != 0
        x = simulate(block, BLOCK, [0.0, 1.0], None, 0.5, samples=3)
        assert np.array_equal(x[:, 0, 0], [0.0, 0.5, 1.0])
    finally:
        cache.cache_folder.cache_clear()


def test_a_full_disk_leaves_nothing_behind(fresh, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "no space left on device")

    monkeypatch.setattr(os, "replace", full)
    cache.keep_code("name", b"code")
    assert list(fresh.iterdir()) == []
    assert cache.cached_code("name") is None


def test_every_kind_of_array_and_number_gives_the_same_motion(block):
    u = np.linspace(0.0, 1.0, 20)
    locked = u.copy()
    locked.setflags(write=False)
    paths = []
    for given in (u, locked, u.reshape(20, 1), np.repeat(u, 2)[::2], u[:, None].astype(">f8"), list(u)):
        for count in (21, np.int32(21)):
            paths.append(simulate(block, BLOCK, np.zeros(2, np.float32), given, np.float64(0.01), samples=count))
    assert all(np.array_equal(paths[0], path) for path in paths)


def test_code_depends_on_processor_version_and_text():
    assert (
        len({cache.key("a", "b", "c"), cache.key("a", "b", "d"), cache.key("ab", "", "c"), cache.key("a", "bc")}) == 4
    )
