"""Is an image the same each time, made of what the wheel has, and does a board hold its ceilings?"""

from __future__ import annotations

import math
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from benchmarks.boards import COUNTS, FULL_SCALE, Board
from upright.errors import BadInput
from upright.rigs.firmware import BOARDS, board_of, build_image, ceilings_in_words, ceilings_of
from upright.rigs.firmware import images as images_of
from upright.rigs.protocol import Limits

ROOT = Path(__file__).parents[3]
EVERY = [(board, drive) for board in BOARDS.values() for drive in board.drives]
LIMITS = Limits(
    travel=(1.5, math.inf), speed=(20.0, 30.0), start=(0.3, math.inf), command=5.0, watchdog=0.02, saturation=0.7
)


def needs(board):
    if missing := [tool for tool in board.tools if shutil.which(tool) is None]:
        pytest.skip(f"{', '.join(missing)} is missing")


@pytest.mark.slow
@pytest.mark.parametrize(("board", "drive"), EVERY, ids=lambda v: getattr(v, "name", v))
def test_an_image_is_the_same_to_the_byte_each_time(board, drive, tmp_path):
    needs(board)
    first, again = (build_image(board, drive, tmp_path / part).path.read_bytes() for part in ("first", "again"))
    assert first == again
    assert len(first) > 20_000
    assert str(tmp_path).encode() not in first


@pytest.mark.slow
def test_every_drive_has_an_image_of_its_own(tmp_path):
    for board in BOARDS.values():
        needs(board)
        made = {build_image(board, drive, tmp_path).path.read_bytes() for drive in board.drives}
        assert len(made) == len(board.drives)


@pytest.mark.slow
def test_a_wheel_has_all_that_an_image_is_built_from(tmp_path):
    with (ROOT / "pyproject.toml").open("rb") as file:
        listed = tomllib.load(file)["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    for source, target in listed.items():
        assert target == f"upright/rigs/firmware/source/{Path(source).name}"
        shutil.copy(ROOT / source, tmp_path)
    for board, drive in EVERY:
        needs(board)
        name = board.image(drive)
        subprocess.run(["make", "-s", "-C", tmp_path, f"B={tmp_path}/b", f"{tmp_path}/b/{name}"], check=True)
        assert (tmp_path / "b" / name).read_bytes() == build_image(board, drive, tmp_path / "out").path.read_bytes()


def test_ceilings_are_a_rig_s_limits_in_counts_ticks_and_percent():
    """16,000 counts a turn: 1.5 rad are 3819.7 of them, 20 rad/s 407.4 in 8 ms."""
    assert ceilings_of(LIMITS, (COUNTS, -COUNTS), FULL_SCALE) == {
        "COMMAND": 50, "TRAVEL_1": 3820, "SPEED_1": 408, "TRAVEL_2": 0x7FFFFFFF, "SPEED_2": 612, "SATURATION": 700,
    }  # fmt: skip


def test_a_maker_reads_each_ceiling_with_its_unit_and_none_where_there_is_none():
    words = dict(ceilings_in_words({**ceilings_of(LIMITS, (COUNTS, COUNTS), FULL_SCALE), "BRAKE": 300}))
    assert words == {
        "command": "50 % of full output", "travel of encoder 1": "3,820 counts", "travel of encoder 2": "none",
        "speed of encoder 1": "408 counts in 8 ms", "speed of encoder 2": "612 counts in 8 ms",
        "time at the largest command": "700 ms", "brake after a stop": "300 ms",
    }  # fmt: skip


def test_a_board_holds_the_ceilings_that_it_was_built_for(tmp_path):
    if not sys.platform.startswith("linux") or shutil.which("cc") is None:
        pytest.skip("needs cc on Linux")
    flags = " ".join(f"-DCEILING_{k}={v}" for k, v in ceilings_of(LIMITS, (COUNTS, COUNTS), FULL_SCALE).items())
    here = Path(__file__).parents[3] / "firmware"  # the board without hardware is not in the package
    subprocess.run(["make", "-s", "-C", here, f"B={tmp_path}", f"CEILINGS={flags}", "host"], check=True)
    board = Board(tmp_path / "rig-host", "lockstep")
    try:
        rig = board.rig()
        rig.open()
        rig.clear_fault()
        free = (math.inf, math.inf)
        held = rig.configure(Limits(travel=free, speed=free, start=free, command=FULL_SCALE, saturation=math.inf))
        # rounded up by a count at most, which is 0.4 mrad, or 0.05 rad/s in 8 ms
        assert held.travel == (pytest.approx(1.5, abs=4e-4), math.inf)
        assert held.speed == pytest.approx((20.0, 30.0), abs=0.05)
        assert held.command == pytest.approx(5.0)
        assert held.saturation == pytest.approx(0.7)
    finally:
        board.close()


def test_without_a_compiler_the_image_of_the_package_is_taken_or_what_is_missing_named(tmp_path, monkeypatch):
    mega = board_of("mega")
    monkeypatch.setattr(shutil, "which", lambda tool: None)
    monkeypatch.setattr(images_of, "READY", tmp_path / "ready")
    with pytest.raises(BadInput, match=r"make and avr-gcc must be on this machine \(sudo apt install make gcc-avr"):
        build_image(mega, "pair", tmp_path)
    (tmp_path / "ready").mkdir()
    (tmp_path / "ready" / "atmega2560-pair.hex").write_bytes(b"as built")
    image = build_image(mega, "pair", tmp_path / "out")
    assert image.ready
    assert image.path.read_bytes() == b"as built"
    with pytest.raises(BadInput, match="with your ceilings"):
        build_image(mega, "pair", tmp_path, {"COMMAND": 50})


@pytest.mark.parametrize("name", ["uno", "Nano"])
def test_a_board_that_is_too_small_is_refused_with_the_reason(name):
    with pytest.raises(BadInput, match=rf"'{name}' is too small a board: .* need 3 kB of memory.*Mega 2560"):
        board_of(name)


def test_a_board_or_a_drive_that_is_none_is_refused():
    with pytest.raises(BadInput, match="did you mean 'atmega2560'"):
        board_of("atmega256")
    with pytest.raises(BadInput, match=r"no drive 'pwm'; choose with --drive: analog, pair, sign"):
        board_of("mega").image("pwm")
