"""Do the commands that a page shows run as they stand there, one after the other, with the files its reader has?"""

from __future__ import annotations

import os
import re
import shlex
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import upright as up
from benchmarks.__main__ import NAMES
from tests.study.draft import test_accelerating as accelerating
from upright.cli import app

ROOT = Path(__file__).parents[1]
WRITTEN = [page for page in sorted((ROOT / "docs").rglob("*.md")) if "_build" not in page.parts]
LINE = re.compile(r"^(?: {4,}|#+ .*`)((?:upright|python -m) [^`\n]+?)(?:`| {2,}#.*| # .*)?$", re.M)
"""A line of its own, or the end of a heading; what stands behind a hash is a comment."""
TITLE = re.compile(r"upright [a-z-]+")
"""What a page's heading says that it is about."""

SERVES, BOARD, MINUTES = "serves until it is stopped", "needs a board", "takes a minute or more"
LEFT_OUT = {
    "upright bench": SERVES,
    "upright bench RIG.toml --law design/design.json": SERVES,
    "upright bench --class roster.csv --lan": SERVES,
    "python -m mujoco.viewer --mjcf=mujoco/rig.xml": "opens a window",
    "upright firmware flash --board mega --drive pair": BOARD,
    "upright firmware flash --board mega --drive pair --rig RIG.toml": BOARD,
    "upright lab --rig serial:/dev/ttyACM0": BOARD,
    "upright rig check": "measures a minute of real time",
    "upright ladder examples/studies/ecp210_ladder.toml --data DATA -o out": MINUTES,
    **{
        f"upright lab{rest}": MINUTES
        for rest in (
            "",
            " --seed 7",
            " --rig linear",
            " --rig linear --seed 3",
            " --experiment 2",
            " --rig furuta --nonideal",
            " --json",
            " --rig RIG.toml",
        )
    },
}
"""Lines that do not run here, and why."""
BENCHMARKS = {f"python -m benchmarks {name}" for name in NAMES}
REPEATED = ("method",)
"""Pages that show lines of other pages alone."""
ENDS_WITH = {'upright swing-up --fault "theta=2"': 3}
"""Exit codes that a page promises where they are not zero."""


def lines(page: Path) -> list[str]:
    """Commands of a page, in order."""
    text = page.read_text(encoding="utf-8")
    titles = re.findall(rf"^#.*`({TITLE.pattern})`$", text, re.M)
    shown = LINE.findall(text)
    for title in titles:
        shown.remove(title)
    return shown


def block(page: str, first: str) -> str:
    """The file that a page shows, by its first line."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    inner = re.search(rf"^( *)({re.escape(first)}.*?\n)(?=\n?^(?!\1)|```)", text, re.M | re.S)
    assert inner, f"{page} shows no file that begins with {first!r}"
    return re.sub(rf"^{inner[1]}", "", inner[2], flags=re.M)


def fitted(folder: Path) -> None:
    """`out/fit.json` of a rotary pendulum, with what its loop needs."""
    up.frequency(rig="furuta", out=folder / "out")


def twin(folder: Path) -> None:
    """`RIG.toml` that reaches a twin where the reader's reaches a board."""
    (folder / "RIG.toml").write_text('kind = "twin"\nmake = "furuta"\nat = "inverted"\n', encoding="utf-8")


def swung(path: Path, **start: str) -> Path:
    """A log of a driven rotary pendulum."""
    arm = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=1e-3, b_2=6e-5, b_1c=2e-3, b_2c=1e-4)
    t = np.arange(0, 10, 5e-3)
    motion = up.simulate(
        arm, u=0.05 * np.sin(2 * t + 0.05 * t**2), seconds=10, dt=5e-3, start=start or {"theta": "40 deg"}
    )
    table = motion.to_pandas()[["psi", "theta", "T"]].round(4).rename(columns={"T": "u"})
    table.to_csv(path, index_label="time [s]")
    return path


def played(folder: Path) -> None:
    fitted(folder)
    swung(folder / "other_day.csv")


def on_a_rig(folder: Path) -> None:
    fitted(folder)
    twin(folder)
    shutil.copyfile(folder / "out/fit.json", folder / "fit.json")


def run(folder: Path) -> None:
    """`run.mcap`, three seconds of a balanced twin."""
    on_a_rig(folder)
    up.design(folder / "fit.json", poles="-4+-2j, -17, -3", out=folder / "design")
    up.run(folder / "RIG.toml", law=folder / "design/design.json", duration=3.0, out=folder / "runs")
    shutil.move(folder / "runs/run.mcap", folder / "run.mcap")


def designed(folder: Path) -> None:
    fitted(folder)
    (folder / "model.toml").write_text(block("howto/design.md", "A = [[0, 1]"), encoding="utf-8")


def two_days(folder: Path) -> None:
    """Two fits of one rig on two days, and two models of one log, with a log that none has seen."""
    ask = ["J_d", "J_p", "b_1", "b_2", "b_1c", "b_2c"]
    known = {"m_p": "135 g", "r": "16 cm", "l_cg": "19 cm"}
    monday, friday = swung(folder / "monday.csv"), swung(folder / "friday.csv", theta="-30 deg")
    for name, log, more in (
        ("monday", monday, ask),
        ("friday", friday, ask),
        ("coulomb", monday, ask),
        ("viscous", monday, ask[:4]),
    ):
        up.identify(log, up.Furuta, known=known | {n: 0.0 for n in ask if n not in more}, ask=more).save(
            folder / f"{name}-fit"
        )
    swung(folder / "other_day.csv", theta="20 deg")
    up.init(folder / "other_day.csv", out=folder / "OTHER.toml", plant="furuta")


def exported(folder: Path) -> None:
    """A fit, and the model of a pendulum in MuJoCo's format."""
    fitted(folder)
    up.export(folder / "out/fit.json", to="mjcf", out=folder / "another")
    shutil.copyfile(folder / "another/rig.xml", folder / "rig.xml")


def responses(folder: Path) -> None:
    """Sweeps of a cart's twin, of a flexible arm, and a disk's response from an analyser."""
    up.frequency(rig="linear", seed=3, out=folder / "cart")
    shutil.copyfile(folder / "cart/sweep.csv", folder / "sweep.csv")
    up.frequency(rig="furuta", ask="multisine", out=folder / "arm")
    up.init(folder / "arm/sweep.csv", out=folder / "study.toml", plant="furuta")
    public = Path(os.environ["UPRIGHT_REAL_DATA"]) / "flexible_robot_freqresp"
    for k, name in enumerate(("one", "two", "three", "four"), 1):
        text = (public / f"swept{k}-0-10hz.txt").read_text(encoding="utf-8")
        (folder / f"{name}.txt").write_text(text.replace("$\\theta$", "enc"), encoding="utf-8")
    study = block("howto/frequency.md", '[rig]\nplant = "torsional-1"')
    (folder / "my-study.toml").write_text(study, encoding="utf-8")

    def disk(hertz: np.ndarray) -> np.ndarray:
        s = 2j * np.pi * hertz
        return 0.2 / (0.0025 * s**2 + 0.02 * s + 1.2)

    # settled sines of six seconds each
    f = np.repeat(np.geomspace(0.5, 15, 12), 1200)
    t = np.tile(5e-3 * np.arange(1200), 12)
    turn = np.exp(2j * np.pi * f * t)
    np.savetxt(
        folder / "sines.csv",
        np.column_stack([5.0 * np.arange(t.size), turn.imag, np.degrees((turn * disk(f)).imag)]),
        delimiter=";",
        header="Time [ms];Motor [V];Angle [deg]",
        comments="",
        fmt="%.7g",
    )
    f = np.geomspace(0.3, 30, 40)
    answer = disk(f)
    table = np.column_stack([f, 20 * np.log10(abs(answer)), np.degrees(np.angle(answer))])
    np.savetxt(
        folder / "analyser.csv",
        table,
        delimiter=",",
        header="Frequency (Hz), Magnitude (dB), Phase (deg)",
        comments="",
        fmt="%.5g",
    )


def weighed(folder: Path) -> None:
    """Logs of a cart on a spring, bare and with one or two masses."""
    up.loadings(rig="rectilinear", out=folder / "weighed")
    for k, name in enumerate(("bare", "one", "two")):
        log = (folder / f"weighed/{k}x500g_run1.csv").read_text(encoding="utf-8")
        (folder / f"{name}.csv").write_text(log.replace("x_1", "x"), encoding="utf-8")


def rated(folder: Path) -> None:
    shutil.copyfile(ROOT / "examples/survey/synthetic_wide.csv", folder / "ratings.csv")


def stepped(folder: Path) -> None:
    accelerating.logged(folder / "log.csv", 12.0)


def swung_up(folder: Path) -> None:
    """The swings that the encoders are checked with, as the twin logs them."""
    fitted(folder)
    up.swing_up(out=folder / "swings")
    shutil.copyfile(folder / "swings/sensors.csv", folder / "swings.csv")


def closed(folder: Path) -> None:
    """A proportional loop's log: target, angle, and the command that follows from them."""
    t = np.arange(0, 20, 2e-3)
    target, theta = 0.1 * np.sign(np.sin(t)), 0.2 * np.sin(3 * t) + 0.1 * np.sin(7.3 * t + 1)
    table = np.column_stack([t, target, theta, np.clip(3.5 * (target - theta), -0.5, 0.5)])
    np.savetxt(folder / "run.csv", table, delimiter=",", header="t,target,theta,u", comments="")


def own_plant(folder: Path) -> None:
    """What the page has its reader save."""
    text = (ROOT / "docs/tutorials/own_plant.md").read_text(encoding="utf-8")
    plant, use = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
    (folder / "seesaw.py").write_text(plant, encoding="utf-8")
    exec(plant + use.replace("from seesaw import Seesaw\n", ""), {})
    (folder / "study.toml").write_text(
        block("tutorials/own_plant.md", '[rig]\nplant = "seesaw.py:Seesaw"'), encoding="utf-8"
    )


def first_log(folder: Path) -> None:
    """A fall from upright, and a crane's four runs."""
    public = Path(os.environ["UPRIGHT_REAL_DATA"])
    shutil.copyfile(public / "pendulum_cart_coulomb_aau/pend1test/test1pend1.csv", folder / "swing.csv")
    (folder / "crane_cart_pendulum_kawata").symlink_to(public / "crane_cart_pendulum_kawata")
    shutil.copyfile(ROOT / "examples/studies/kawata_crane.toml", folder / "crane.toml")
    # The same fall to the other side stands for another day.
    rows = np.genfromtxt(folder / "swing.csv", delimiter=",")
    rows[:, 1:] = [2 * np.pi, 0] - rows[:, 1:]
    np.savetxt(folder / "thursday.csv", rows, delimiter=", ", fmt="%.5f")
    (folder / "other.toml").write_text(block("tutorials/first_log.md", '[rig]\nplant = "pendulum"'), encoding="utf-8")


HAS: dict[str, Callable[[Path], None]] = {
    "closed_loop": closed,
    "compare": two_days,
    "design": designed,
    "doctor": lambda folder: swung(folder / "run.csv"),
    "export": exported,
    "firmware": twin,
    "first_log": first_log,
    "frequency": responses,
    "lab": twin,
    "loadings": weighed,
    "logs": run,
    "own_plant": own_plant,
    "own_rig": twin,
    "play": played,
    "regulate": fitted,
    "rigs": on_a_rig,
    "stepper": stepped,
    "survey": rated,
    "swing_up": swung_up,
}
"""What the reader of a page has before its first line."""
PAGES = {page.stem: page for page in (ROOT / "README.md", *WRITTEN) if lines(page)}
RUN = [name for name, page in PAGES.items() if name not in REPEATED and not LEFT_OUT.keys() >= set(lines(page))]


def test_only_lines_that_stand_on_a_page_are_left_out():
    shown = {name: lines(page) for name, page in PAGES.items()}
    assert LEFT_OUT.keys() | ENDS_WITH.keys() <= {line for page in shown.values() for line in page}
    assert HAS.keys() <= set(RUN)
    for name in REPEATED:
        assert set(shown[name]) <= {line for other in shown if other != name for line in shown[other]} | BENCHMARKS


def test_a_benchmark_that_a_page_names_exists():
    named = [line for page in PAGES.values() for line in lines(page) if line.startswith("python -m benchmarks")]
    assert len(named) > 10
    assert set(named) <= BENCHMARKS


@pytest.mark.slow
@pytest.mark.real_data
@pytest.mark.parametrize("name", RUN)
def test_the_commands_of_a_page_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")  # the reader's checkout
    HAS.get(name, lambda folder: None)(tmp_path)
    data = {"DATA": os.environ["UPRIGHT_REAL_DATA"], "DIR": "."}
    for line in lines(PAGES[name]):
        if line in LEFT_OUT or line in BENCHMARKS:
            continue
        outcome = CliRunner().invoke(app, [data.get(word, word) for word in shlex.split(line)[1:]])
        assert outcome.exit_code == ENDS_WITH.get(line, 0), f"{line}\n{outcome.output[-1000:]}"
