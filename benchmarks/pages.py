"""How does every kind of page look? `python -m benchmarks.pages -o FOLDER [--only fit design ...]`.

Every kind is made by its verb, then photographed by Debian's Chromium at 360, 768 and 1280 px, light and dark, and as
printed on A4, and its PDF page by page; the table lists bytes and sheets.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
WIDTHS = (360, 768, 1280)
TALLEST = 12_000
"""Pixels of a page that are photographed; what is longer goes on in the same way."""


def arm() -> Any:
    """A rig of the size of a laboratory's."""
    import upright as up

    plant = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=0.003, b_2=2e-4, b_1c=0.008, b_2c=3e-4)
    return up.Rig.known(plant, name="bench 3", gain="0.65 N m/V", limit="3 V", period="2 ms", counts=4096)


def lab(out: Path) -> Path:
    import upright as up

    up.lab(out=out)
    return out / "report.html"


def _of_lab(verb: str, log: str, page: str, **options: Any) -> Callable[[Path], Path]:
    """A page of a verb that takes what the laboratory left."""

    def made(out: Path) -> Path:
        import upright as up

        source = out.parent / "lab" / log
        if not source.exists():
            lab(out.parent / "lab")
        getattr(up, verb)(source, out=out, pdf=True, **options)
        return out / page

    return made


def _answer(verb: str, log: str, **options: Any) -> Callable[[Path], Path]:
    """The report of an answer that writes none by itself."""

    def made(out: Path) -> Path:
        import upright as up

        source: Any = ROOT / log if log.startswith("examples") else out.parent / "lab" / log
        if not log.startswith("examples") and not source.exists():
            lab(out.parent / "lab")
        answer = getattr(up, verb)(source, **options)
        answer.report(out / "report.pdf")
        return answer.report(out / "report.html")

    return made


def design(out: Path) -> Path:
    import upright as up

    up.design(arm(), at="inverted", out=out, pdf=True)
    return out / "design.html"


def run(out: Path) -> Path:
    """Three seconds of a sine on a twin behind the protocol."""
    import upright as up

    (out / "RIG.toml").write_text('kind = "twin"\nmake = "furuta"\nseed = 3\n', encoding="utf-8")
    up.run(out / "RIG.toml", excite="sine 0.3 1", duration=3.0, watch=False, out=out, pdf=True)
    return next(out.glob("*.html"))


def compare(out: Path) -> Path:
    """Two fits of one rig, by a sweep and by free swings, on a swing that one of them saw."""
    import upright as up

    there = out.parent / "lab"
    if not there.exists():
        lab(there)
    up.compare([there / "1b/fit.json", there / "4/fit.json"], there / "4/release_90.csv", out=out, pdf=True)
    return out / "comparison.html"


def play(out: Path) -> Path:
    import upright as up

    up.play(arm(), out=out / "play.html")
    return out / "play.html"


def motion(out: Path) -> Path:
    """A loop that catches a pendulum, played."""
    import upright as up

    gains = up.place(arm().linear("inverted"), [-4 + 2j, -4 - 2j, -17, -3])
    up.simulate(arm(), gains, start={"theta": "8 deg"}, seconds=3).play(out=out / "motion.html")
    return out / "motion.html"


def paper(out: Path) -> Path:
    import upright as up

    return up.reproduce().report(out / "report.html")


PAGES: dict[str, Callable[[Path], Path]] = {
    "lab": lab,
    "fit": _of_lab("identify", "4/free_swing.toml", "report.html"),
    "regulate": _of_lab("regulate", "1b/fit.json", "report.html"),
    "design": design,
    "run": run,
    "track": _of_lab("track", "3/fit.json", "track.html"),
    "swing-up": _of_lab("swing_up", "1b/fit.json", "swing_up.html"),
    "ladder": _of_lab("ladder", "4/level_model.toml", "ladder.html"),
    "law": _of_lab(
        "law", "2/regulation_set_1.csv", "law-regulation_set_1.html", command="u", measured=("psi", "theta")
    ),
    "compare": compare,
    "log": _answer("show", "4/release_60.csv"),
    "play": play,
    "motion": motion,
    "doctor": _answer("doctor", "2b/swing_up.csv"),
    "survey": _answer("survey", "examples/survey/synthetic_wide.csv"),
    "paper": paper,
}


def main(arguments: list[str]) -> int:
    """Make the pages, photograph them, and print a line for each."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.pages", description=__doc__)
    parser.add_argument("-o", "--out", type=Path, required=True, help="folder for pages and pictures")
    parser.add_argument("--only", nargs="*", choices=PAGES, default=list(PAGES), help="kinds of pages")
    chosen = parser.parse_args(arguments)
    print(f"{'page':10} {'html [kB]':>10} {'pdf [kB]':>9} {'sheets':>7}")
    for name in chosen.only:
        folder = chosen.out / name
        folder.mkdir(parents=True, exist_ok=True)
        page = PAGES[name](folder).resolve()
        photograph(page, folder)
        pdf = page.with_suffix(".pdf")
        sheets = sheets_of(pdf, folder) if pdf.exists() else 0
        size = pdf.stat().st_size / 1e3 if pdf.exists() else 0.0
        print(f"{name:10} {page.stat().st_size / 1e3:10.0f} {size:9.0f} {sheets:7}")
    return 0


def photograph(page: Path, folder: Path) -> None:
    """The page at every width, light and dark, and printed."""
    from playwright.sync_api import sync_playwright

    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    with sync_playwright() as runner:
        browser = runner.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for scheme in ("light", "dark"):
            for width in WIDTHS:
                context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
                view = context.new_page()
                view.goto(page.as_uri())
                high = min(view.evaluate("document.documentElement.scrollHeight"), TALLEST)
                view.set_viewport_size({"width": width, "height": high})
                view.screenshot(path=folder / f"{width}-{scheme}.png")
                if scheme == "light" and width == WIDTHS[-1]:
                    view.pdf(path=folder / "print.pdf", format="A4", prefer_css_page_size=True)
                context.close()
        browser.close()


def sheets_of(pdf: Path, folder: Path) -> int:
    """Sheets of a PDF, counted."""
    import pypdf

    return len(pypdf.PdfReader(pdf).pages)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
