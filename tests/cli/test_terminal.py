"""Do pictures, pages and text come out whatever the terminal, the environment and the user's settings?

Each command runs in a process of its own, because encodings and settings are those of a process.
"""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

posix = pytest.mark.skipif(os.name != "posix", reason="streams are closed and devices are full by POSIX's shell")


SETTINGS = "MPLBACKEND", "SOURCE_DATE_EPOCH"
"""Of whoever runs the tests; each test sets its own."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A log whose columns have names that neither ASCII nor cp1252, nor the font of the pictures, can show."""
    here = tmp_path_factory.mktemp("logs")
    t = np.arange(600) * 0.01
    theta = np.round(400 * np.exp(-0.1 * t) * np.cos(6 * t))
    rows = "\n".join(f"{a:.2f},{b:.0f},{np.sin(a):.4f}" for a, b in zip(t, theta, strict=True))
    (here / "log.csv").write_text(f"t,ψ_漢,u\n{rows}\n", encoding="utf-8")
    return here


def run(folder, *words, cwd=None, shell="", **environment):
    """Outcome of a command; `shell` stands behind it in a shell."""
    line = [sys.executable, "-m", "upright", *words]
    given = {
        "cwd": cwd or folder,
        "env": {k: v for k, v in os.environ.items() if k not in SETTINGS} | environment,
        "stdout": subprocess.PIPE,
        "stderr": subprocess.PIPE,
    }
    if shell:
        return subprocess.run(" ".join(line) + shell, shell=True, executable="/bin/bash", check=False, **given)
    return subprocess.run(line, check=False, **given)


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8"])
@pytest.mark.slow
def test_text_comes_out_in_any_encoding(folder, tmp_path, encoding):
    done = run(folder, "show", "log.csv", "-o", str(tmp_path), PYTHONIOENCODING=encoding)
    assert (done.returncode, done.stderr) == (0, b"")
    text = done.stdout.decode(encoding)
    assert "600 samples" in text
    assert ("ψ_漢" if encoding == "utf-8" else "_?") in text
    help_ = run(folder, "--help", PYTHONIOENCODING=encoding)
    assert (help_.returncode, help_.stderr) == (0, b"")


@pytest.mark.slow
def test_numbers_for_a_program_are_the_same_in_any_encoding(folder):
    said = [
        json.loads(run(folder, "doctor", "log.csv", "--json", PYTHONIOENCODING=encoding).stdout.decode(encoding))
        for encoding in ("ascii", "cp1252", "utf-8")
    ]
    assert said[0] == said[1] == said[2]


slow = pytest.mark.slow
BAD = [
    {"MPLBACKEND": "nonsense", "SOURCE_DATE_EPOCH": "yesterday"},
    pytest.param({"SOURCE_DATE_EPOCH": "9" * 30}, marks=slow),
    pytest.param({"MPLCONFIGDIR": os.path.join(os.devnull, "x")}, marks=slow),
    pytest.param({"COLUMNS": "-3"}, marks=slow),
    {"matplotlibrc": "text.usetex: True\nlines.linewidth: 9\nsavefig.bbox: tight\nfont.family: nobody\nbad line\n"},
]


@pytest.fixture(scope="module")
def plain(folder, tmp_path_factory):
    """The picture and the page that are made where nothing is set."""
    out = tmp_path_factory.mktemp("plain")
    return made(folder, out, folder)


def made(folder, out, cwd, **environment):
    log = str(folder / "log.csv")
    drawn = run(folder, "show", log, "-o", str(out), cwd=cwd, **environment)
    told = run(folder, "doctor", log, "-o", str(out / "page.html"), cwd=cwd, **environment)
    assert (drawn.returncode, drawn.stderr) == (0, b"")
    assert (told.returncode in (0, 3), told.stderr) == (True, b"")
    return [(out / name).read_bytes() for name in ("show-log.svg", "page.html")]


@pytest.mark.parametrize("setting", BAD, ids=lambda s: "=".join(next(iter(s.items())))[:30].split("\n")[0])
@pytest.mark.slow
def test_pictures_and_pages_depend_on_no_setting(folder, plain, tmp_path, setting):
    """To the byte, and without a word on stderr: nothing about glyphs, backends, fonts or dates."""
    here = tmp_path / "here"
    here.mkdir()
    if "matplotlibrc" in setting:
        (here / "matplotlibrc").write_text(setting["matplotlibrc"], encoding="utf-8")
    environment = {k: v for k, v in setting.items() if k.isupper()}
    assert made(folder, tmp_path, here, **environment) == plain


@posix
@pytest.mark.parametrize(
    ("shell", "code"),
    [(" | head -1; exit ${PIPESTATUS[0]}", 0), (" >&-", 0), (" 2>&-", 0), (" >&- 2>&-", 0), (" > /dev/full", 2)],
)
@pytest.mark.slow
def test_a_terminal_that_goes_away_leaves_no_traceback(folder, tmp_path, shell, code):
    done = run(folder, "show", "log.csv", "-o", str(tmp_path), shell=shell)
    assert done.returncode == code
    assert done.stderr.count(b"\n") == (1 if code else 0)
    assert b"Traceback" not in done.stderr


@pytest.mark.slow
def test_warnings_of_libraries_stay_off_the_terminal(folder, tmp_path):
    """NumPy says of 0/0 what a sentence should; with UPRIGHT_DEBUG it may speak."""
    script = (
        "import sys\n"
        "import numpy as np\n"
        "from upright import readers\n"
        "from upright.cli import main\n"
        "def read(*_, **__) -> None:\n"
        "    np.zeros(1) / np.zeros(1)\n"
        "    raise SystemExit\n"
        "readers.read = read\n"
        "sys.argv = ['upright', 'show', 'log.csv']\n"
        "main()\n"
    )
    for debug, words in (("0", False), ("1", True)):
        done = subprocess.run(
            [sys.executable, "-c", script],
            env={**os.environ, "UPRIGHT_DEBUG": debug}, capture_output=True, text=True, check=True,
        )  # fmt: skip
        assert ("RuntimeWarning" in done.stderr) == words
