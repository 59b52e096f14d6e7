"""Does an instructor see at a glance who holds the pendulum, who fell and who needs help, while students work?"""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.browser.students import DESK, PHONE, Server, Student, student
from tests.live.browser import until

pytestmark = pytest.mark.slow
NAMES = ("Änne Müller", "Bob", "Cleo", "Đorđe")


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    folder = tmp_path_factory.mktemp("class")
    roster = folder / "roster.csv"
    roster.write_text("name\n" + "\n".join(NAMES), encoding="utf-8")
    opened = Server(folder, roster=roster)
    yield opened
    opened.close()


@contextmanager
def instructor(chromium, server, *, dark=False, **kind):
    """Somebody who opens the address that was printed for them."""
    context = chromium.new_context(color_scheme="dark" if dark else "light", **(kind or DESK))
    someone = Student(context.new_page())
    someone.page.goto(server.instructor_url)
    someone.reads("#summary", "idle|upright|fell|stopped")
    yield someone
    context.close()


def tile(page, name):
    return page.locator("#students a", has_text=name)


def test_an_instructor_sees_who_fell_and_stops_everybody(server, chromium):
    with (
        student(chromium, server, rig="anne-muller") as anne, student(chromium, server, rig="bob") as bob,
        instructor(chromium, server) as teacher,
    ):  # fmt: skip
        page = teacher.page
        assert page.url == f"{server.url}#/class"
        teacher.reads("#summary", "^4 idle$")
        anne.reads("#rig-name", "Änne Müller")
        anne.page.keyboard.press("Tab")  # the keyboard alone
        for _ in range(40):
            if anne.page.locator("#start:focus").count():
                break
            anne.page.keyboard.press("Tab")
        anne.page.keyboard.press("Enter")
        anne.sees("running")
        bob.starts()
        teacher.reads("#summary", "2 upright, 2 idle")
        teacher.reads("#students a:has-text('Bob')", r"upright for \d+ s")
        bob.page.locator("#next label:has-text('tap') input").fill("20")
        bob.page.locator("#next label:has-text('tap') input").press("Tab")
        bob.page.click("#tap")
        bob.sees("stopped")
        bob.reads("#latch-why", "it fell")
        teacher.reads("#students a[data-state=fell]", r"Bob\s*fell at \d+ s")
        teacher.reads("#summary", "1 upright, 1 fell, 2 idle")
        anne.sees("running")
        page.keyboard.press("Escape")
        anne.sees("stopped")
        anne.reads("#latch-why", "Stopped by the instructor")
        teacher.reads("#summary", "1 fell, 1 stopped, 2 idle")
        tile(page, "Bob").click()
        page.wait_for_selector("#state[data-state=stopped]")
        teacher.reads("#rig-name", "Bob")
        teacher.reads("#operator", "Another page operates")
        for one in (bob, teacher):  # the log is there before its report
            one.page.click("#tab-runs")
            with one.page.expect_download() as coming:
                one.page.get_by_role("link", name="Log").click()
            assert Path(coming.value.path()).read_bytes()[1:6] == b"MCAP0"
        bob.page.click("#control")
        bob.reads("#runs-unreadable", "take control first")
        assert bob.page.get_by_role("link", name="Log").count() == 0
        bob.page.click("#control")
        bob.reads("#control", "Give up")
        page.get_by_role("link", name="All students").click()
        teacher.reads("#summary", "1 fell, 1 stopped, 2 idle")
        for one in (anne, bob):
            one.leaves()
        assert [*teacher.wrong, *anne.wrong, *bob.wrong] == []
        assert [*teacher.foreign(server), *anne.foreign(server)] == []


def test_a_student_chooses_their_name_and_sees_nobody_else(server, chromium):
    context = chromium.new_context(**DESK)
    one = Student(context.new_page())
    one.page.goto(server.url)
    one.reads("h1", "Who are you")
    assert one.page.locator("#students a").all_inner_texts() == list(NAMES)
    assert one.page.locator("#stop").count() == 0
    one.page.get_by_role("link", name="Cleo").click()
    one.reads("#rig-name", "Cleo")
    assert one.page.url == f"{server.url}#/cleo/run"
    assert one.page.locator("#rigs a").all_inner_texts() == ["Not you? All names"]
    one.page.click("#tab-identify")
    one.reads(
        "#identify .note",
        "record a step.* Swing-up, first motions, weighing and another velocity filter are not offered here",
    )
    assert one.page.locator("#from option").all_inner_texts() == ["held upright", "hanging: sweep", "hanging: step"]
    for what in ("#from", "#record-sweep", "#record-step"):
        one.page.wait_for_selector(what)
    for what in ("#fit-motions", "#weigh", "#fit-use", "#filter"):
        assert not one.page.locator(what).is_visible()
    one.page.goto(f"{server.url}#/class")
    one.reads("h1", "Who are you")
    assert one.wrong == []
    context.close()


@pytest.mark.parametrize("dark", [False, True])
def test_axe_finds_nothing_at_any_width(server, chromium, dark):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    for kind in (DESK, {"viewport": {"width": 390, "height": 844}}, PHONE):
        with instructor(chromium, server, dark=dark, **kind) as teacher:
            assert axe.Axe().run(teacher.page).response["violations"] == []
            until(teacher.page, f"document.documentElement.scrollWidth <= {kind['viewport']['width']}")
            assert teacher.page.locator("#stop").is_visible()
        context = chromium.new_context(color_scheme="dark" if dark else "light", **kind)
        page = context.new_page()
        page.goto(server.url)
        page.get_by_role("link", name="Cleo").wait_for()
        assert axe.Axe().run(page).response["violations"] == []
        until(page, f"document.documentElement.scrollWidth <= {kind['viewport']['width']}")
        context.close()


def test_a_class_whose_server_is_gone_says_so_and_comes_back(server, chromium):
    with instructor(chromium, server) as teacher:
        server.kill()
        teacher.reads("#message", "stops nobody")
        server.open()
        # a new server has new tokens: who looked on needs the new address, which says so by its silence
        teacher.page.goto(server.instructor_url)
        teacher.reads("#summary", "4 idle")
