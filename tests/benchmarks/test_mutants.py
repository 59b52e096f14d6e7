"""Does `python -m benchmarks mutants` change one place at a time, and does it see whether tests notice?"""

import ast
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.mutants import drawn, interval, judged, room, table
from benchmarks.mutants.covering import Covering, joined, map_of
from benchmarks.mutants.places import Change, compiles, places
from benchmarks.mutants.trial import Bench, Outcome
from benchmarks.mutants.trying import Kept, said, tried

ROOT = Path(__file__).parents[2]


def changed(source: str) -> set[str]:
    """Every text that one change makes of a source."""
    text = source.encode()
    return {
        Change(path="x.py", place=place, text=new).applied(text).decode()
        for place in places(text)
        for new in place.instead
    }


@pytest.mark.parametrize(
    ("source", "some"),
    [
        ("a < b", {"a <= b", "a > b"}),
        ("(a) == (b)  # a == b", {"(a) != (b)  # a == b"}),
        ("a is not b", {"a is b"}),
        ("a not   in b", {"a in b"}),
        ("a or b or c", {"a and b or c", "a or b and c"}),
        ("x = a * b", {"x = a / b"}),
        ("x += a", {"x -= a"}),
        ("x = -a", {"x = +a"}),
        ("x = not a", {"x = bool(a)"}),
        ("x = 3", {"x = 4", "x = 2"}),
        ("x = 0", {"x = 1"}),
        ("x = 0.5", {"x = 1.0", "x = 0.25"}),
        ("x = True", {"x = False"}),
        ("if a:\n    b()", {"if not (a):\n    b()", "if True:\n    b()", "if False:\n    b()"}),
        ("x = a[i:]", {"x = a[(i) + 1:]", "x = a[(i) - 1:]"}),
        ("for i in range(n): pass", {"for i in range((n) + 1): pass", "for i in range((n) - 1): pass"}),
        ("x = min(a, b)", {"x = max(a, b)"}),
        ("def f() -> float:\n    return a", {"def f() -> float:\n    return -(a)"}),
        ("def f() -> bool:\n    return a", {"def f() -> bool:\n    return not (a)"}),
        ("θ = 'ψ'; x = a < b  # ψ", {"θ = 'ψ'; x = a <= b  # ψ", "θ = 'ψ'; x = a > b  # ψ"}),
    ],
)
def test_one_place_changes_and_the_rest_is_untouched(source, some):
    assert changed(source) == some


@pytest.mark.parametrize(
    "source",
    [
        '"""3 < 4"""', "x: Literal[3]", "def f(a: 'b < 3') -> Annotated[int, 3]: ...",
        "@dataclass(frozen=True)\nclass A: ...", "raise E(f'{a < 3}')", "x = f'{a:3} of {b + 1}'", "assert a < 3",
        "rng = np.random.default_rng([seed, 31])", "if TYPE_CHECKING:\n    x = 3",
    ],
)  # fmt: skip
def test_what_is_not_computed_with_is_left_alone(source):
    assert changed(source) == set()


@pytest.mark.slow
def test_changes_of_a_room_are_programs_of_another_meaning():
    """60 of them: each differs in one stretch of its file and in its syntax tree."""
    for change in drawn(ROOT, 60, seed=5, within="signals"):
        source = (ROOT / change.path).read_bytes()
        after = change.applied(source)
        assert compiles(after)
        assert ast.dump(ast.parse(after)) != ast.dump(ast.parse(source))
        assert after[: change.place.start] == source[: change.place.start]
        assert source.endswith(after[change.place.start + len(change.text) :])


def test_a_seed_draws_the_same_changes_again():
    first, second = (drawn(ROOT, 20, seed=9, within="gains") for _ in range(2))
    assert first == second
    assert {room(change.path) for change in first} == {"gains"}
    assert first != drawn(ROOT, 20, seed=10, within="gains")


def test_wilsons_interval_is_that_of_the_score():
    """Its ends are the shares p for which the hits are 1.96 standard deviations of p away."""
    for hits, of in ((120, 155), (1, 5), (0, 7), (7, 7)):
        for p in interval(hits, of):
            assert of * (hits / of - p) ** 2 == pytest.approx(1.959964**2 * p * (1 - p), abs=1e-9)


HALF = "def half(x):\n    return x / 2\n\n\ndef spare(x):\n    return x / 4\n"
TESTS = """
import pkg

def test_half():
    assert pkg.half(3) == 1.5

def test_nothing():
    pkg.spare(8)

def test_broken():
    assert pkg.spare(8) == 3
"""


@pytest.fixture
def tree(tmp_path):
    """A repository with a package of two functions, one of them tested, and a test that fails in any case."""
    root = tmp_path / "root"
    for name, text in {
        "src/pkg.py": HALF, "tests/test_pkg.py": TESTS, "benchmarks/__init__.py": "", "pyproject.toml": "",
        "benchmarks/mutants/__init__.py": "",
        "benchmarks/mutants/watch.py": (ROOT / "benchmarks/mutants/watch.py").read_text(encoding="utf-8"),
    }.items():  # fmt: skip
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text, encoding="utf-8")
    subprocess.run(["git", "init", "-q"], cwd=root, check=True)
    return root


def covering_of(root, **tests):
    names = [f"tests/test_pkg.py::{name}" for name in tests]
    lines = {line: [i] for i, line in enumerate(tests.values())}
    return Covering(
        seconds=dict.fromkeys(names, 0.01), tests=names, files=["tests/test_pkg.py"], lines={"src/pkg.py": lines}
    )


@pytest.mark.slow
def test_a_file_of_tests_that_cannot_be_imported_in_any_case_notices_nothing(tree, tmp_path):
    """One that imports what is not there stands beside one that does; a change by which none can is noticed."""
    (tree / "tests/test_gone.py").write_text("from pkg import gone\n\ndef test_gone():\n    pass\n", encoding="utf-8")
    half, spare = (Change(path="src/pkg.py", place=p, text=b"*") for p in places(HALF.encode()) if b"*" in p.instead)
    gone = "tests/test_gone.py::test_gone"
    quick = covering_of(tree, test_half=2, test_nothing=5)
    lines = {2: [0, 2], 5: [1, 2]}
    covering = replace(
        quick, seconds=quick.seconds | {gone: 0.01}, tests=[*quick.tests, gone], lines={"src/pkg.py": lines}
    )
    bench = Bench(tree, tmp_path / "bench", None)
    assert bench.outcome(half, covering).by == "tests/test_pkg.py::test_half"
    assert not bench.outcome(spare, covering).noticed
    broken = Change(path="src/pkg.py", place=half.place, text=b"/ 0\n\n\n1 / 0 *")
    assert bench.outcome(broken, quick).by == "the tests cannot be imported"


@pytest.mark.slow
def test_what_came_of_a_change_is_kept_and_not_tried_again(tree, tmp_path):
    bench = Bench(tree, tmp_path / "bench", None)
    file = tmp_path / "kept.jsonl"
    changes = [Change(path="src/pkg.py", place=p, text=b"*") for p in places(HALF.encode()) if b"*" in p.instead]
    covering = covering_of(tree, test_half=2)
    first = tried([bench], changes[:1], covering, 60.0, Kept(file), lambda _: None)
    heard = []
    again = tried([bench], changes, covering, 60.0, Kept(file), heard.append)
    assert [o.noticed for o in again] == [True, False]
    assert again[:1] == first
    assert len(heard) == 1  # of the second change alone
    assert tried([bench], changes[:1], covering, 60.0, Kept(file), heard.append) == first
    assert len(heard) == 1


@pytest.mark.slow
def test_a_change_is_noticed_by_a_test_that_passes_without_it(tree, tmp_path):
    """The test of the function that changed; not one that only runs it, and not one that fails in any case."""
    bench = Bench(tree, tmp_path / "bench", None)
    half, spare = (
        Change(path="src/pkg.py", place=place, text=b"*") for place in places(HALF.encode()) if b"*" in place.instead
    )
    first = bench.outcome(half, covering_of(tree, test_half=2))
    assert (first.noticed, first.by) == (True, "tests/test_pkg.py::test_half")
    second = bench.outcome(spare, covering_of(tree, test_nothing=5, test_broken=6))
    assert (second.noticed, second.ran) == (False, 2)
    assert (bench.tree / "src/pkg.py").read_text(encoding="utf-8") == HALF
    assert second.shown == "return x / 4 -> return x * 4"


@pytest.mark.slow
def test_a_change_that_never_ends_is_noticed(tree, tmp_path):
    watch = tree / "benchmarks/mutants/watch.py"
    text = watch.read_text(encoding="utf-8")
    assert "HANG, SLOWER = 30.0" in text
    watch.write_text(text.replace("HANG, SLOWER = 30.0", "HANG, SLOWER = 0.5"), encoding="utf-8")
    (tree / "src/pkg.py").write_text(
        "def half(x):\n    while 0 > x:\n        pass\n    return x / 2\n", encoding="utf-8"
    )
    place = next(p for p in places((tree / "src/pkg.py").read_bytes()) if b"<" in p.instead)
    change = Change(path="src/pkg.py", place=place, text=b"<")
    outcome = Bench(tree, tmp_path / "bench", None).outcome(change, covering_of(tree, test_half=2))
    assert (outcome.noticed, outcome.by) == (True, "tests/test_pkg.py::test_half hangs or ends the process")


@pytest.mark.slow
def test_a_map_names_the_tests_that_run_a_line_of_a_file_that_is_traced(tree, tmp_path):
    """`half` divides in its second line, `spare` in its sixth; a test that fails in any case maps nothing."""
    pytest.importorskip("coverage")
    (tree / "src/other.py").write_text("import pkg\n", encoding="utf-8")
    covering = map_of(tree, tmp_path / "maps", 1, lambda _: None, {"src/pkg.py"})
    assert covering.of("src/pkg.py", 2, 2, HALF) == ["tests/test_pkg.py::test_half"]
    assert covering.of("src/pkg.py", 6, 6, HALF) == ["tests/test_pkg.py::test_nothing"]
    assert set(covering.lines) == {"src/pkg.py"}
    # kept: nothing runs again
    heard = []
    assert map_of(tree, tmp_path / "maps", 1, heard.append, {"src/pkg.py"}) == covering
    assert not heard


def test_maps_of_different_tests_are_joined():
    name = "src/upright/p.py"
    first = Covering(seconds={"x": 1.0, "y": 1.0}, tests=["x", "y"], files=["a"], lines={name: {2: [0], 4: [1]}})
    both = joined(first, Covering(seconds={"z": 1.0}, tests=["z"], files=[], lines={name: {2: [0]}}), ["b"])
    text = "def f():\n    b\n    c\n    d\n"
    assert set(both.of(name, 2, 2, text)) == {"x", "z"}
    assert both.of(name, 4, 4, text) == ["y"]
    # a line that no test runs: those of the whole module stand in
    assert set(both.of(name, 1, 1, text)) == {"x", "y", "z"}
    assert both.files == ["a", "b"]


def test_a_line_of_a_module_is_covered_by_all_that_run_the_module_and_not_by_who_imported_it():
    """A module that a function imports runs its own lines, its signatures among them, within one test."""
    text = "ONE = 1\ndef f(x=2):\n    return x\ndef g():\n    return ONE\n"
    tests = [f"tests/test_{name}.py::x" for name in ("first", "f", "g")]
    lines = {1: [0], 2: [0], 4: [0], 3: [1], 5: [2]}
    made = Covering(seconds=dict.fromkeys(tests, 1.0), tests=tests, files=[], lines={"src/upright/p.py": lines})
    by = {line: made.of("src/upright/p.py", line, line, text) for line in lines}
    assert set(by[1]) == set(tests)
    assert by[2] == by[3] == tests[1:2]
    assert by[4] == by[5] == tests[2:]


def test_quick_tests_alone_and_all_tests_have_a_share_each():
    """Of four changes one is noticed by a quick test and two by slow ones: 25 and 75 %."""
    changes = drawn(ROOT, 4, seed=1, within="gains")
    quick, slow = (
        [
            Outcome(change=c, shown=f"a < {i}", noticed=i in noticed, by=f"test_{i}", ran=3, covering=5)
            for i, c in enumerate(changes)
        ]
        for noticed in ((0,), (1, 2))
    )
    both = {line.contender: line for line in table(quick, by_slow=slow[1:])}
    assert both["all: share not noticed"].ratio[0] == 0.75
    assert both["all, by quick and slow tests: share not noticed"].ratio[0] == 0.25
    assert sum("slow: test_" in line.note for line in both.values()) == 2
    assert sum("slow: 3 ran, 5 cover it" in line.note for line in both.values()) == 1
    assert not [line.contender for line in table(quick) if line.contender.startswith("all, by")]
    # one that the slow tests have not come to yet is not noticed
    some = {line.contender: line for line in table(quick, by_slow=slow[1:2])}
    assert some["all, by quick and slow tests: share not noticed"].ratio[0] == 0.5


def test_a_change_judged_to_make_no_difference_is_left_out_of_the_share(tmp_path):
    changes = drawn(ROOT, 4, seed=1, within="gains")
    outcomes = [
        Outcome(
            change=change,
            shown=change.shown((ROOT / change.path).read_bytes()),
            noticed=i > 1,
            by="",
            ran=3,
            covering=3,
        )
        for i, change in enumerate(changes)
    ]
    every = {line.contender: line for line in table(outcomes)}
    assert every["all: share not noticed"].ratio[0] == 0.5
    assert len(every) == 2 + 2  # room, all, two changes that were not noticed
    file = tmp_path / "judged.txt"
    file.write_text(f"{said(outcomes[0].change, outcomes[0].shown)}  # a warning's wording\n", encoding="utf-8")
    judged_out = {line.contender: line for line in table(outcomes, judged(file))}
    assert judged_out["all: share not noticed"].ratio[0] == pytest.approx(1 / 3)
    assert "1 judged" in judged_out["all: share not noticed"].note
