"""Write the gallery: simulated rigs that move in the page, the experiments' report, and every public rig identified.

Public rigs need their logs, in the folder that UPRIGHT_REAL_DATA names; without it their pages say where the logs are.
"""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from html import escape
from multiprocessing import get_context
from pathlib import Path

import upright as up
from upright.rig.makes import MAKES

STUDIES = Path(__file__).parent.parent / "examples" / "studies"
LIVE = {"furuta": "Furuta pendulum", "linear": "Pendulum on a cart"}


def write(pages: Path, files: Path, *, quick: bool = False) -> None:
    """Pages for Sphinx; live twins and reports as files beside what it makes of them. A quick one identifies nothing."""
    for folder in (pages, files):
        folder.mkdir(parents=True, exist_ok=True)
    data = "" if quick else os.environ.get("UPRIGHT_REAL_DATA", "")
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn")) as pool:
        public = {
            p.stem: pool.submit(_study, p, data, files) for p in sorted(STUDIES.glob("*.toml"))
        }
        simulated = {name: pool.submit(_live, name, title, files) for name, title in LIVE.items()}
        if not quick:
            simulated["laboratory"] = pool.submit(_laboratory, files)
        for name, text in {**simulated, **public}.items():
            (pages / f"{name}.md").write_text(text.result(), encoding="utf-8")
    index = [_INDEX, _toctree("Simulated rigs", simulated), _toctree("Public rigs", public)]
    (pages / "index.md").write_text("\n".join(index), encoding="utf-8")


_INDEX = """# Gallery

Every page here was made by the build: the studies in `examples/studies/` were identified, and the simulated rigs run.
"""


def _toctree(title: str, names: Iterable[str]) -> str:
    return f"## {title}\n\n```{{toctree}}\n:maxdepth: 1\n\n" + "\n".join(names) + "\n```\n"


def _live(name: str, title: str, files: Path) -> str:
    """A rig of the laboratory, live."""
    up.play(MAKES[name].rig, draws=100, out=files / f"{name}-live.html")
    return (
        f"# {title}, live\n\n"
        "SIMULATED: a rig with the numbers of a design, not of a machine that somebody measured. Push the pendulum, "
        "drag the poles, add friction or delay.\n\n"
        f"{_frame(f'{name}-live.html', title)}\n"
        f"The page is one file, [{name}-live.html]({name}-live.html), written by `upright play`; "
        "[the live twin](../howto/play.md) says what it can do.\n"
    ).replace(
        f"[{name}-live.html]({name}-live.html)", f'<a href="{name}-live.html">{name}-live.html</a>'
    )


def _frame(file: str, title: str) -> str:
    return f'<div class="gallery"><iframe src="{file}" title="{escape(title)}" loading="lazy"></iframe></div>\n'


def _laboratory(files: Path) -> str:
    """Report of all experiments on simulated rigs."""
    import shutil
    from tempfile import TemporaryDirectory

    with TemporaryDirectory() as folder:
        up.lab(out=folder)
        shutil.copyfile(Path(folder) / "report.html", files / "laboratory.html")
    return (
        "# All experiments, one report\n\n"
        'What `upright lab` writes: <a href="laboratory.html">the report</a> of a simulated rig, from weighing to '
        "holding it upright, with every verdict. The [notebooks](../tutorials/course.md) go through the same "
        "experiments step by step.\n"
    )


def _study(path: Path, data: str, files: Path) -> str:
    """A public rig: where its logs are from, what was identified, and the report."""
    study = tomllib.loads(path.read_text(encoding="utf-8"))
    link = f"[{path.name}](../examples/studies/{path.name})"
    head = f"# {study['title']}\n\nLogs: {study['source']}.\n\n"
    if not data:
        return (
            f"{head}{link} identifies this rig once the logs are in a folder DATA:\n\n"
            f"```text\nupright identify {path.name} --data DATA -o out\n```\n"
        )
    fit = up.identify(path, data=data)
    fit.report(files / f"{path.stem}.html")
    answers = "\n".join(f"* **{a.question}** {a.headline}" for a in fit.answers)
    figure = fit.plot()
    figure.savefig(files / f"{path.stem}.png", dpi=64)
    width, height = (int(64 * inches) for inches in figure.get_size_inches())
    return (
        f'{head}Study: {link}. Full result: <a href="{path.stem}.html">the report</a>.\n\n{answers}\n\n'
        f'<img src="{path.stem}.png" width="{width}" height="{height}" alt="Measured and simulated signals of every '
        f'run, {escape(study["title"])}" loading="lazy">\n'
    )
