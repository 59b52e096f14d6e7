"""Pictures of the bench for the documentation: `python -m tests.browser.pictures docs/images`."""

from __future__ import annotations

import sys
import tempfile
import time
from io import BytesIO
from pathlib import Path

from PIL import Image

from tests.browser.runs import record_first_motions, twin
from tests.browser.students import PHONE, Server, browser, student

NAMES = ("bench_run", "bench_identify", "bench_design", "bench_track", "bench_phone")


def take(folder: Path, server: Server) -> None:
    """Run, Track, Design in the dark, and a phone that watches, each of a run that goes on."""
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


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as runs:
        record_first_motions(twin(Path(runs)), Path(runs) / "furuta", started=time.time())
        opened = Server(Path(runs), fifo=True)
        take(Path(sys.argv[1]), opened)
        take_fit(Path(sys.argv[1]), opened)
        opened.close()
