"""A bench as a process of its own, and people in front of it, each with a browser."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.parse import urlsplit
from urllib.request import urlopen

import pytest

from tests.live.browser import CHROMIUM

PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True, "device_scale_factor": 2}
DESK = {"viewport": {"width": 1280, "height": 720}}
PATIENCE = 240_000  # ms, on a machine that may do much else; a swing-up is designed meanwhile


class Server:
    """`upright bench` as its user starts it, with rigs or with its twin of the Furuta pendulum, or for a class."""

    def __init__(self, folder: Path, *rigs: Path, fifo: bool = False, roster: Path | None = None) -> None:
        if not files("upright.browser").joinpath("page/index.html").is_file():
            pytest.skip("the page is not built: npm --prefix bench install && npm --prefix bench run build")
        self.folder, self.rigs, self.port, self.fifo, self.roster = folder, rigs, 0, fifo, roster
        self.open()

    def open(self) -> None:
        """Start it, at the port that it had before."""
        command = [sys.executable, "-m", "upright", "bench", *map(str, self.rigs), "--no-browser"]
        command += ["-o", str(self.folder), *([] if self.fifo else ["--no-fifo"])]
        command += [] if self.roster is None else ["--class", str(self.roster)]
        self.process = subprocess.Popen([*command, "--port", str(self.port)], stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if address := re.search(r"http://127\.0\.0\.1:(\d+)/", line):
                self.url, self.port = address[0], int(address[1])
                self.instructor_url = line.split()[-1]  # of a class
                self._compile()
                return
        raise AssertionError("the bench printed no address")

    def _compile(self) -> None:
        """Ask for every rig's kernel before anybody comes: a browser without a graphics card leaves it no processor."""
        for rig in self.rigs_of():
            with suppress(HTTPError):  # a rig may have none
                urlopen(f"{self.url}rigs/{rig['name']}/twin.js").read()

    def rigs_of(self) -> list[dict[str, Any]]:
        """What it says of its rigs."""
        return json.load(urlopen(f"{self.url}api/rigs"))["rigs"]

    def kill(self) -> None:
        """End it as a crash does."""
        self.process.kill()
        self.process.wait()
        self._forget()

    def close(self) -> None:
        """End it as `kill` does; Ctrl-C is not heard where these tests run in a shell's background."""
        self.process.terminate()
        self.process.wait(PATIENCE / 1000)
        self._forget()

    def _forget(self) -> None:
        """Close its output: a file that is left open is reported in whatever test comes next."""
        if self.process.stdout is not None:
            self.process.stdout.close()


class Student:
    """Somebody before the page: what they read and press."""

    def __init__(self, page: Any) -> None:
        self.page, self.requests, self.wrong = page, [], []
        page.set_default_timeout(PATIENCE)
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("pageerror", lambda error: self.wrong.append(str(error)))
        page.on("console", lambda message: self.wrong.append(message.text) if message.type == "error" else None)

    def sees(self, state: str) -> None:
        """Wait until the page says that the rig is in a state."""
        self.page.wait_for_selector(f"#state[data-state={state}]")

    def reads(self, selector: str, text: str) -> None:
        """Wait until something visible says a text."""
        try:
            self.page.locator(selector, has_text=re.compile(text)).first.wait_for(state="visible")
        except Exception as error:
            shown = {
                each: self.page.locator(each).all_inner_texts() for each in (selector, "#state", "#message", "#gate")
            }
            raise AssertionError(f"{selector} never read {text!r}: {shown}, {self.wrong}") from error

    def until(self, wanted: Callable[[], bool], what: str = "it") -> None:
        """Wait for what the page shows nobody, in steps of the browser's clock."""
        for _ in range(PATIENCE // 50):
            if wanted():
                return
            self.page.wait_for_timeout(50)
        raise AssertionError(f"{what} did not come")

    def presses(self, selector: str) -> None:
        """Press a button, even one that is locked: it says why."""
        self.page.click(selector, force=True)

    def starts(self) -> None:
        """Take control by starting."""
        self.page.click("#start")
        self.sees("running")

    def foreign(self, server: Server) -> list[str]:
        """Requests that went elsewhere than to this server."""
        return [url for url in self.requests if urlsplit(url).netloc not in (urlsplit(server.url).netloc, "")]

    def leaves(self) -> None:
        """Leave the rig idle and free, as the next one would like to find it."""
        if self.page.locator("#state[data-state=running], #state[data-state=starting]").count():
            self.page.keyboard.press("Escape")
            self.sees("stopped")
        if self.page.locator("#state[data-state=stopped]").count():
            self.rearms()
        if self.page.locator("#control", has_text="Give up").is_visible():
            self.page.click("#control")
            self.reads("#operator", "Nobody")

    def rearms(self) -> None:
        """Arm the rig again, once it has come to rest."""
        # a rig on its way to rest refuses with a sentence; pressed only while it is there to be pressed
        self.page.wait_for_function(
            """() => {
          const idle = document.querySelector('#state[data-state=idle]');
          if (!idle) document.querySelector('#latch:not([hidden]) #rearm:not([hidden])')?.click();
          return idle }""",
            polling=200,
        )


@contextmanager
def browser() -> Iterator[Any]:
    """Debian's Chromium."""
    playwright = pytest.importorskip("playwright.sync_api")
    if CHROMIUM is None:
        pytest.skip("Chromium is missing")
    with playwright.sync_playwright() as runner:
        opened = runner.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"], timeout=PATIENCE)
        yield opened
        opened.close()


@contextmanager
def student(
    opened: Any, server: Server, *, screen: str = "run", dark: bool = False,
    prepare: Callable[[Any], Any] = lambda _: None, rig: str = "furuta", **kind: Any,
) -> Iterator[Student]:  # fmt: skip
    """Somebody who opens the page, once it is prepared."""
    context = opened.new_context(color_scheme="dark" if dark else "light", **(kind or DESK))
    someone = Student(context.new_page())
    prepare(someone.page)
    someone.page.goto(f"{server.url}#/{rig}/{screen}")
    try:
        someone.page.wait_for_selector("#state:not([data-state=lost])")
        yield someone
    except BaseException:
        if someone.page.locator("#control", has_text="Give up").is_visible():
            someone.leaves()  # what one test leaves running fails the next ones too
        raise
    finally:
        context.close()
