"""Whose log may be brought and identified, and what is kept of it? With the work itself done by hand."""

from __future__ import annotations

import json
import threading

import pytest

from tests.browser.runs import SOON, settled, twin
from tests.browser.test_served import Client, client, got
from upright.browser.identify.fits import LARGEST, LOOKS, MOST, OWN, Identifications, Shared, shown_name
from upright.browser.identify.routes import WHO
from upright.browser.serve import Bench
from upright.errors import BadInput


class ByHand:
    """Stands for `Bounded`: gives what it is let give."""

    def __init__(self):
        self.calls, self.ran, self.answer, self.interrupted = [], 0, '{"rows": 2, "seconds": 1.0, "columns": ["x"]}', 0
        self._over = threading.Event()
        self._over.set()

    def __call__(self, task, *arguments, progress=None, **bounds):
        self.calls.append(arguments)
        self.bounds, self.progress = bounds, progress
        return self

    def hold(self):
        self._over.clear()

    def go(self):
        self._over.set()

    def run(self):
        assert self._over.wait(SOON)
        self.ran += 1
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer

    def interrupt(self):
        self.interrupted += 1

    kill = interrupt


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    return twin(tmp_path_factory.mktemp("bench"))


@pytest.fixture
def bench(rig, tmp_path_factory):
    with Bench([rig], tmp_path_factory.mktemp("served")) as bench:
        yield bench


@pytest.fixture
def made(rig, tmp_path):
    carry = ByHand()
    return Identifications(rig, tmp_path, carry), carry, tmp_path


@pytest.mark.parametrize(
    ("name", "kept"),
    [("../../etc/passwd", "passwd"), ("C:\\logs\\swing.csv", "swing.csv"), ("a\x00b\n.csv", "ab.csv"), ("", "log"),
     ("..", ".."), ("x" * 500, "x" * 100), ("\udcff.csv", ".csv")],
)  # fmt: skip
def test_a_name_is_for_sentences_and_never_a_path(made, name, kept):
    fits, _, folder = made
    assert shown_name(name) == fits.keep(name, b"1 2")["name"] == kept
    assert sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()) == [
        "uploads/log-1.json", "uploads/log-1.log",
    ]  # fmt: skip


def test_a_refused_log_leaves_nothing_and_takes_nothing_away(made):
    fits, carry, folder = made
    fits.keep("good.csv", b"1 2")
    before = {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    carry.answer = BadInput("'bad.csv', line 3: expected a number.")
    with pytest.raises(BadInput, match=r"'bad.csv', line 3"):
        fits.keep("bad.csv", b"nonsense")
    assert {p: p.read_bytes() for p in folder.rglob("*") if p.is_file()} == before
    assert [log["name"] for log in fits.logs()] == ["good.csv"]


def test_a_log_that_is_too_large_or_one_too_many_is_refused(made):
    fits, carry, _ = made
    with pytest.raises(BadInput, match="more than 20 MB"):
        fits.keep("large.csv", b"0" * (LARGEST + 1))
    for _ in range(MOST):
        fits.keep("x.csv", b"1 2")
    with pytest.raises(BadInput, match=f"{MOST} logs were brought already"):
        fits.keep("x.csv", b"1 2")
    assert len(carry.calls) == MOST


def test_one_fit_at_a_time_and_an_interrupt_reaches_it(made):
    fits, carry, _ = made
    with pytest.raises(BadInput, match="nothing is being identified"):
        fits.interrupt()
    with pytest.raises(BadInput, match="no such log"):
        fits.begin("../../etc/passwd", OWN, {})
    fits.keep("swing.csv", b"1 2")
    carry.hold()
    carry.answer = BadInput("nothing moves.")
    fits.begin("log-1", "columns", {})
    with pytest.raises(BadInput, match="another log is being identified"):
        fits.begin("log-1", "columns", {})
    carry.progress("first 1 s", 0.2)
    now = fits.described()["now"]
    assert (now["name"], now["step"]) == ("swing.csv", "first 1 s")
    assert (now["looks"], fits.picture()) == (0, {"id": "fit-1", "explained": []})
    curves = [{"signal": "theta"}]
    carry.bounds["show"]({"evaluations": 40, "explained": {"theta": 20.0}, "curves": curves})
    carry.bounds["show"]({"evaluations": 90, "explained": {"theta": 10.0}})  # worse, so that the curves stay
    explained = [[40, {"theta": 20.0}], [90, {"theta": 10.0}]]
    assert fits.picture() == {"id": "fit-1", "explained": explained, "curves": curves}
    for k in range(10 * LOOKS):
        carry.bounds["show"]({"evaluations": 100 + k, "explained": {"theta": 30.0}})
    assert len(fits.picture()["explained"]) <= LOOKS
    assert fits.picture()["explained"][0] == explained[0]
    assert fits.described()["now"]["looks"] == 2 + 10 * LOOKS
    fits.interrupt()
    assert carry.interrupted == 1
    carry.go()
    assert settled(fits, lambda each: each.described()["now"] is None)
    described = fits.described()
    assert (described["failed"], described["fits"]) == ("Nothing moves.", [])
    assert fits.picture() is None


def test_fits_of_a_class_go_on_one_after_the_other_and_whoever_waits_may_leave(rig, tmp_path):
    shared, carries = Shared(seconds=100.0), [ByHand() for _ in range(3)]
    one, two, three = (
        Identifications(rig, tmp_path / str(k), carry, shared) for k, carry in enumerate(carries)
    )  # fmt: skip
    for each, carry in zip((one, two, three), carries, strict=True):
        each.keep("swing.csv", b"1 2")
        carry.answer = BadInput("nothing moves.")
        carry.hold()
        carry.ran = 0
        each.begin("log-1", "columns", {})
    assert carries[2].bounds["seconds"] == 100.0
    steps = [each.described()["now"]["step"] for each in (one, two, three)]
    assert steps == ["starting", "waiting: 1 fit of the class before it", "waiting: 2 fits of the class before it"]
    two.interrupt()
    assert settled(two, lambda each: each.described()["now"] is None)
    assert two.described()["failed"] == "It was taken back before it began."
    assert three.described()["now"]["step"] == "waiting: 1 fit of the class before it"
    for each, carry in ((one, carries[0]), (three, carries[2])):
        carry.go()
        assert settled(each, lambda each: each.described()["now"] is None)
        assert each.described()["failed"] == "Nothing moves."
    assert [carry.ran for carry in carries] == [1, 0, 1]


def test_of_a_brought_log_its_columns_tell_the_rig_unless_somebody_says_it_is_this_one(made, rig):
    fits, carry, folder = made
    fits.keep("swing.csv", b"1 2")
    for of, expected in (("columns", None), (OWN, rig.file)):
        carry.answer = BadInput("nothing moves.")
        fits.begin("log-1", of, {"m_p": "1 kg"})
        assert settled(fits, lambda each: each.described()["now"] is None)
        path, name, known, measured, target = carry.calls[-1]
        assert (path, name, known, measured) == (folder / "uploads/log-1.log", "swing.csv", expected, {"m_p": "1 kg"})
        assert target.parent == folder / "fits"


def ask(bench, path, me, method="POST", data=b"1 2", wait=SOON, **headers):
    return got(bench, path, method=method, data=data, headers={WHO: me, **headers}, wait=wait)


def test_only_the_operator_at_a_page_of_this_bench_brings_and_identifies(bench):
    logs, fits = "api/rigs/furuta/logs?name=a.csv", "api/rigs/furuta/fits"
    assert "for the page of this bench" in ask(bench, logs, "made-up")[2]
    with client(bench) as first, client(bench) as second:
        first.ask("operate")
        assert isinstance(first, Client)
        first.note("state", operator="you")
        for path, method in ((logs, "POST"), (fits, "POST"), (fits, "DELETE")):
            status, _, text = ask(bench, path, second.me, method)
            assert (status, text) == (400, "Somebody else operates it.")
            assert ask(bench, path, first.me, method, Origin="http://evil.example")[0] == 403
            assert ask(bench, path, first.me, method, **{"Sec-Fetch-Site": "cross-site"})[0] == 403
        assert ask(bench, fits, first.me, "DELETE")[2] == "Nothing is being identified."
    assert json.loads(got(bench, fits)[2]) == {"logs": [], "now": None, "failed": "", "fits": []}
    for path in ("fits/now", "recording", "weighing"):
        assert got(bench, f"api/rigs/furuta/{path}")[::2] == (200, "null")


def test_what_is_no_request_for_a_fit_is_answered_by_one_that_is(bench):
    with client(bench) as page:
        for body in (
            b"", b"{}", b"[]", b"1", b"nonsense", b"\xff", b'{"log": 1, "of": "rig"}', b'{"log": "run", "of": "moon"}',
            b'{"log": "run", "of": ["rig"]}', b"[" * 4000,
            b'{"log": "run", "of": "rig", "known": 1}', b'[{"log": "run"}]',
        ):  # fmt: skip
            status, _, text = ask(bench, "api/rigs/furuta/fits", page.me, data=body)
            assert (status, '{"log": "run", "of": "rig"}' in text) == (400, True)


def test_what_was_measured_is_a_text_by_its_name(bench):
    with client(bench) as page:
        for known in ({"m_p": 1}, {"m_p": ["1 kg"]}, {"m_p": "1" * 200}):
            body = json.dumps({"log": "run", "of": "rig", "known": known}).encode()
            assert '"m_p": "0.22 kg"' in ask(bench, "api/rigs/furuta/fits", page.me, data=body)[2]


def test_more_than_may_come_is_refused_before_it_comes(bench):
    with client(bench) as page:
        for path in ("logs?name=a.csv", "fits"):
            text = ask(bench, f"api/rigs/furuta/{path}", page.me, **{"Content-Length": str(LARGEST + 1)})[2]
            assert "this takes" in text.lower()
    assert got(bench, "api/rigs")[0] == 200


def test_nothing_else_of_the_fits_answers(bench):
    for path in (
        "api/rigs/nobody/fits", "rigs/furuta/fits/fit-1.json", "rigs/furuta/fits/..%2f..%2ffuruta.toml",
        "rigs/furuta/fits/fit-1.toml", "rigs/nobody/fits/fit-1.html", "api/rigs/nobody/fits/now",
        "api/rigs/nobody/recording",
    ):  # fmt: skip
        assert got(bench, path)[0] == 404
