"""Pictures of the bench for the documentation: `python -m tests.browser.pictures docs/images`; `sweep` takes that one.

It is the sweep of a flexible shaft, whose mode is measured, in real time: two minutes.
"""

from __future__ import annotations

import json
import sys
import tempfile
import threading
import time
from contextlib import ExitStack
from io import BytesIO
from pathlib import Path

from PIL import Image
from websockets.sync.client import connect

from tests.browser.runs import record_first_motions, twin
from tests.browser.students import DESK, PHONE, Server, Student, browser, student

NAMES = (
    "bench_run", "bench_identify", "bench_sweep", "bench_design", "bench_track", "bench_guide", "bench_phone",
    "bench_class",
)  # fmt: skip
SHAFT = 'kind = "twin"\nname = "shaft"\nmake = "torsional"\n'
FIRST = [
    "Ada", "Ben", "Chen", "Dilek", "Émile", "Fatma", "Goran", "Hana", "Ivo", "Jana", "Kofi", "Lena", "Mats", "Nadia",
    "Omar", "Pia", "Quentin", "Rosa", "Søren", "Tomás", "Uta", "Vera", "Wei", "Xenia", "Yusuf", "Zoë", "Anouk", "Björn",
    "Clara", "Deniz",
]  # fmt: skip
"""Of the class of sixty; each with one of two letters."""


def take(folder: Path, server: Server) -> None:
    """Run, Track, the guide, Design in the dark, and a phone that watches, each of a run that goes on."""
    with browser() as chromium, student(chromium, server) as one:
        one.page.wait_for_selector("#drawing polyline", state="attached")
        one.starts()
        for _ in range(2):
            one.page.wait_for_timeout(2500)
            one.page.click("#tap")
        one.page.wait_for_timeout(1500)
        one.page.mouse.move(0, 300)
        one.page.screenshot(path=folder / "bench_run.png")
        with student(chromium, server, **{**PHONE, "device_scale_factor": 1}) as phone:
            phone.page.wait_for_timeout(5000)
            phone.page.screenshot(path=folder / "bench_phone.png")
        one.page.click("#tab-track")
        one.page.wait_for_timeout(4000)
        one.page.click("#follow")
        one.reads("#track-now", "step")
        one.page.wait_for_timeout(6000)
        one.page.screenshot(path=folder / "bench_track.png")
        one.page.click("#home")
        one.page.click("#tab-run")
        guided(one)
        one.page.mouse.move(0, 300)
        one.page.screenshot(path=folder / "bench_guide.png")
        one.page.click("#guide-toggle")
        one.page.emulate_media(color_scheme="dark")
        one.page.click("#tab-design")
        one.reads("#share", "rigs are stabilised")
        pairs = one.page.locator("#pairs input")
        for k, value in enumerate(("8", "0.7", "12", "1.3")):
            pairs.nth(k).fill(value)
            pairs.nth(k).press("Enter")
        one.page.locator(".pole[role=slider]").first.focus()
        one.page.wait_for_timeout(3000)
        one.page.screenshot(path=folder / "bench_design.png")
        one.leaves()


def take_fit(folder: Path, server: Server) -> None:
    """Identify, of first motions that are recorded already."""
    with browser() as chromium, student(chromium, server, screen="identify") as one:
        one.page.wait_for_selector("#fit-log option", state="attached")
        one.page.click("#fit-begin")
        one.reads("#fit-status", "The fit is written")
        one.page.wait_for_selector("#fit-pictures canvas")
        one.page.wait_for_timeout(500)
        picture = Image.open(BytesIO(one.page.screenshot()))
        picture.quantize(128, dither=Image.Dither.NONE).save(folder / "bench_identify.png", optimize=True)


def take_sweep(folder: Path, server: Server) -> None:
    """Identify, of a sweep that has just come to its end."""
    with browser() as chromium, student(chromium, server, screen="identify", rig="shaft") as one:
        one.page.click("#record-sweep")
        one.reads("#record-says", r"(\d+) of \1 sines measured")
        one.sees("ended")
        one.page.wait_for_selector("#fit-log option", state="attached")
        one.page.locator("#record-title").scroll_into_view_if_needed()
        one.page.mouse.move(0, 300)
        one.page.wait_for_timeout(500)
        picture = Image.open(BytesIO(one.page.screenshot()))
        picture.quantize(128, dither=Image.Dither.NONE).save(folder / "bench_sweep.png", optimize=True)
        one.leaves()


def guided(one: Student) -> None:
    """Three predictions, and the paper's first and last set of poles after a tap each."""
    one.page.click("#guide-toggle")
    for prediction in ("7", "8", "0.3"):
        one.page.fill("#guide-answer input", prediction)
        one.page.click("#guide-predict")
        one.page.click("#guide-next")
    one.page.locator("#guide-answer input").nth(2).check()
    one.page.click("#guide-predict")
    for chosen in ("1", "4"):
        one.page.click(f"#guide-actions button:nth-child({chosen})")
        one.page.wait_for_timeout(2500)
        one.page.click("#guide-actions button:nth-child(5)")
        one.reads("#guide-measured", rf"set {chosen} \d")
    one.page.locator("#guide-measured").scroll_into_view_if_needed()


def take_class(folder: Path, server: Server) -> None:
    """Sixty students at work: some have fallen, one has stopped, a few are not there yet."""
    with browser() as chromium, ExitStack() as everybody:
        names = [rig["name"] for rig in server.rigs_of()]
        sockets = [everybody.enter_context(connect(f"{server.url.replace('http', 'ws', 1)}live/{n}")) for n in names]
        for socket in sockets:  # whose frames nobody reads
            threading.Thread(target=lambda mine=socket: [None for _ in mine], daemon=True).start()
        for k, socket in enumerate(sockets[:-6]):
            for do in ("operate", "start") if k % 17 else ("operate",):
                socket.send(json.dumps({"do": do}))
        context = chromium.new_context(**DESK)
        page = context.new_page()
        page.goto(server.instructor_url)
        page.get_by_text("50 upright").wait_for()
        page.wait_for_timeout(6000)
        for k in (3, 20, 41):
            sockets[k].send(json.dumps({"do": "tap", "coordinate": "theta", "speed": 12.0}))
        sockets[11].send(json.dumps({"do": "stop"}))
        page.get_by_text("3 fell, 1 stopped").wait_for()
        for k in range(5, 50, 7):
            sockets[k].send(json.dumps({"do": "tap", "coordinate": "theta", "speed": 1.5}))
        page.wait_for_timeout(500)
        page.screenshot(path=folder / "bench_class.png")


def take_all(folder: Path) -> None:
    """Every picture but that of the sweep."""
    with tempfile.TemporaryDirectory() as runs:
        record_first_motions(twin(Path(runs)), Path(runs) / "furuta", started=time.time())
        opened = Server(Path(runs), fifo=True)
        take(folder, opened)
        take_fit(folder, opened)
        opened.close()
    with tempfile.TemporaryDirectory() as runs:
        listed = Path(runs) / "roster.csv"
        listed.write_text("name\n" + "\n".join(f"{n} {c}." for c in "AB" for n in FIRST), encoding="utf-8")
        opened = Server(Path(runs), fifo=True, roster=listed)
        take_class(folder, opened)
        opened.close()


if __name__ == "__main__":
    if sys.argv[2:] != ["sweep"]:
        take_all(Path(sys.argv[1]))
    with tempfile.TemporaryDirectory() as runs:
        shaft = Path(runs) / "shaft.toml"
        shaft.write_text(SHAFT, encoding="utf-8")
        opened = Server(Path(runs), shaft, fifo=True)
        take_sweep(Path(sys.argv[1]), opened)
        opened.close()
