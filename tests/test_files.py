"""Is only what is a file opened, and is what was read never written over?"""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from upright.errors import BadInput
from upright.files import check_output, keeps_its_inputs, read_bytes, read_text, replace_file, whole_file
from upright.identification.frequency.response import FrequencyResponse, is_response
from upright.questionnaire.sheet import read_sheet as read_sheet
from upright.readers import read
from upright.records import Record
from upright.study.load import load_study
from upright.study.stored_fit import read_fit

READERS = {
    "log": read,
    "study": load_study,
    "fit.json": read_fit,
    "survey": lambda path: read_sheet(path, scale=(1, 4)),
    "response": FrequencyResponse.from_csv,
    "record": Record.from_csv,
    "mat": Record.from_mat,
    "parquet": Record.from_parquet,
}
posix = pytest.mark.skipif(os.name != "posix", reason="pipes and devices with a name are those of POSIX")


@posix
@pytest.mark.parametrize("what", READERS)
def test_a_pipe_that_nobody_writes_to_is_not_waited_for(what, tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(BadInput, match="is a pipe, and a regular file is needed"):
        READERS[what](pipe)
    assert not is_response(pipe)


@posix
@pytest.mark.parametrize("device", ["/dev/zero", "/dev/full"])
@pytest.mark.parametrize("what", READERS)
def test_a_device_that_never_ends_is_not_read(what, device, tmp_path):
    (tmp_path / "log.csv").symlink_to(device)
    with pytest.raises(BadInput, match="is a device, and a regular file is needed"):
        READERS[what](tmp_path / "log.csv")


@pytest.mark.parametrize("what", READERS)
def test_a_folder_is_no_file(what, tmp_path):
    with pytest.raises(BadInput, match="is a folder; name the file inside it"):
        READERS[what](tmp_path)


def test_a_file_larger_than_the_memory_it_may_have_is_not_read(tmp_path):
    """It has holes: 3 GB that take no room on the disk."""
    with open(tmp_path / "log.csv", "wb") as file:
        file.truncate(3 << 30)
    with pytest.raises(BadInput, match="holds 3072 MB and is read whole, which is done up to 2048 MB"):
        read(tmp_path / "log.csv")
    with pytest.raises(BadInput, match="up to 4 MB"):
        load_study(tmp_path / "log.csv")


@posix
def test_a_device_is_not_replaced_by_a_file(tmp_path):
    (tmp_path / "null").symlink_to("/dev/null")
    with pytest.raises(BadInput, match="is a device"):
        replace_file(tmp_path / "null", b"x")
    assert (tmp_path / "null").is_symlink()


def test_text_has_the_line_ends_of_text(tmp_path):
    (tmp_path / "a").write_bytes(b"a\r\nb\rc\n")
    assert read_text(tmp_path / "a") == (tmp_path / "a").read_text()


@pytest.mark.parametrize("link", ["same", "hard", "soft"])
def test_a_call_does_not_write_over_what_it_has_read(tmp_path, link):
    log, out = tmp_path / "log.csv", tmp_path / "out.json"
    log.write_bytes(b"measured")
    if link == "same":
        out = tmp_path / "." / "log.csv"
    elif link == "hard":
        out.hardlink_to(log)
    elif os.name == "posix":
        out.symlink_to(log)
    else:
        pytest.skip("a soft link needs rights that not everybody has there")

    @keeps_its_inputs
    def call():
        return replace_file(out, read_bytes(log) + b" and changed")

    with pytest.raises(BadInput, match="is read by this call and would be overwritten"):
        call()
    with pytest.raises(BadInput, match="would be overwritten"):
        check_output(out, log)
    assert log.read_bytes() == b"measured"
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted({"log.csv", out.name})


def test_a_call_may_rewrite_what_it_wrote_itself_and_the_next_call_what_this_one_read(tmp_path):
    """A fit is written, read again, and written with more in it."""
    path = tmp_path / "fit.json"

    @keeps_its_inputs
    def grow(more):
        before = read_bytes(path) if path.exists() else b""
        replace_file(tmp_path / "new", before + more)
        replace_file(tmp_path / "new", read_bytes(tmp_path / "new") + more)

    grow(b"a")
    replace_file(path, read_bytes(tmp_path / "new"))
    grow(b"b")
    assert (tmp_path / "new").read_bytes() == b"aabb"


@posix
def test_a_link_planted_under_the_name_of_an_unfinished_file_is_not_followed(tmp_path):
    """As a neighbour in a shared folder may plant it, who knows what will be written."""
    victim = tmp_path / "victim"
    victim.write_bytes(b"of somebody else")
    (tmp_path / ".fit.json.part").symlink_to(victim)
    replace_file(tmp_path / "fit.json", b"a fit")
    assert victim.read_bytes() == b"of somebody else"
    assert (tmp_path / "fit.json").read_bytes() == b"a fit"
    assert not (tmp_path / "fit.json").is_symlink()
    assert (tmp_path / ".fit.json.part").is_symlink()


def test_an_unfinished_file_has_another_name_each_time_and_is_gone_in_the_end(tmp_path):
    names = set()

    def write(content, error=None):
        with whole_file(tmp_path / "fit.json") as half:
            assert half.parent == tmp_path
            names.add(half.name)
            half.write_bytes(content)
            if error:
                raise error

    for _ in range(3):
        write(b"a fit")
        with pytest.raises(KeyboardInterrupt):
            write(b"half a fit", KeyboardInterrupt)
    assert len(names) == 6
    assert [p.name for p in tmp_path.iterdir()] == ["fit.json"]
    assert (tmp_path / "fit.json").read_bytes() == b"a fit"


@posix
@pytest.mark.parametrize(("before", "after"), [(None, 0o640), (0o600, 0o600), (0o664, 0o664), (0o444, 0o444)])
def test_a_new_file_has_the_usual_permissions_and_a_replaced_one_keeps_its_own(before, after, tmp_path):
    """0o666 less a mask of 0o027 is 0o640; nobody may read more of a private file while it is written either."""
    path = tmp_path / "fit.json"
    usual = os.umask(0o027)
    try:
        if before is not None:
            path.write_bytes(b"before")
            path.chmod(before)
        with whole_file(path) as half:
            assert half.stat().st_mode & 0o077 & ~after == 0
            half.write_bytes(b"after")
    finally:
        os.umask(usual)
    assert (path.read_bytes(), path.stat().st_mode & 0o777) == (b"after", after)


def test_a_name_as_long_as_names_may_be_is_written(tmp_path):
    """255 characters, as ext4, NTFS and APFS have it; what is written meanwhile has a shorter one."""
    name = "x" * (255 if os.name == "posix" else 100)
    assert replace_file(tmp_path / name, b"x").read_bytes() == b"x"


def log_of(path, name="theta"):
    t = np.arange(400) * 0.01
    theta = np.round(600 * np.exp(-0.1 * t) * np.cos(6 * t))
    np.savetxt(path, np.column_stack([t, theta]), "%.10g", ",", header=f"t,{name}", comments="")
    return path


STUDY = """\
[rig]
plant = "pendulum"
[parameters]
m_p = "0.1 kg"
l_cg = { guess = "0.2 m" }
J_p = "1e-3 kg m^2"
[sensors.theta]
unit = "counts"
counts_per_rev = 4096
[[runs]]
file = "swing.csv"
"""
SHAFT = {"J_1": 2e-3, "J_2": 2e-3, "k_12": 2.5, "c_1": 0.0, "c_2": 0.0}
FIT = json.dumps({"format": 1, "plant": "torsional-2", "verdict": "", "parameters": SHAFT})
SURVEY = "student,a pre,a post\n1,1,3\n2,2,4\n3,1,2\n"


@pytest.mark.parametrize(
    ("line", "output", "content"),
    [
        ("init IN -o IN --force", "study.toml", ""),
        ("doctor IN -o IN", "page.html", ""),
        ("survey IN -o .", "report.html", SURVEY),
        ("design IN --poles=-4+-2j,-6,-7 --period=1ms --counts=4096 -o .", "design.json", FIT),
        ("ladder IN -o .", "study.toml", STUDY),
    ],
)
def test_no_command_writes_over_its_input(line, output, content, tmp_path, monkeypatch):
    """The input bears the name of what the command writes."""
    from typer.testing import CliRunner

    from upright.cli import app

    monkeypatch.chdir(tmp_path)
    log_of(tmp_path / "swing.csv")
    path = tmp_path / output
    path.write_text(content or (tmp_path / "swing.csv").read_text(encoding="utf-8"), encoding="utf-8")
    before = path.read_bytes()
    outcome = CliRunner().invoke(app, [output if word == "IN" else word for word in line.split()])
    assert path.read_bytes() == before
    assert outcome.exit_code == 2, outcome.stdout
    assert "would be overwritten" in outcome.stderr
    assert {p.name for p in tmp_path.iterdir()} == {output, "swing.csv"}


def test_a_picture_is_not_drawn_over_the_log(tmp_path):
    from upright.verbs.log import show

    log = log_of(tmp_path / "log.svg")
    with pytest.raises(BadInput, match="would be overwritten"):
        show(log, out=log)
    show(log, out=tmp_path / "picture.svg")
    assert read(log).names == ("theta",)


def test_a_pipe_ends_a_command_at_once(tmp_path):
    """In a process of its own, which would hang."""
    code = (
        "import os, sys; from upright.cli import main\n"
        "os.mkfifo('pipe') if hasattr(os, 'mkfifo') else os.mkdir('pipe')\n"
        "sys.argv = ['upright', 'doctor', 'pipe']; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
