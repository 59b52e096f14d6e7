"""What was measured on a rig is kept until the rig, or what it rests on, is another."""

from __future__ import annotations

from itertools import count
from pathlib import Path

import pytest

from tests.experiments.rigs import declared
from upright.experiments import laboratory
from upright.experiments.stand.experiment import Experiment, ExperimentInput
from upright.experiments.stand.live import live_stand
from upright.report.page import Chapter


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """Two experiments that count how often they were made; the second takes the fit of the first."""
    (tmp_path / "RIG.toml").write_text('kind = "twin"\nmake = "furuta"\n', encoding="utf-8")
    made: list[str] = []
    measured = count()

    def tell(at: ExperimentInput) -> tuple[Chapter, bool]:
        made.append(at.folder.name)
        (at.folder / "fit.json").write_text(f"measurement {next(measured)}", encoding="utf-8")
        return Chapter(title="t", verdict="v"), True

    def experiment(key: str, needs: tuple[str, ...]) -> Experiment:
        return Experiment(
            name=key, title=key, makes=("furuta",), on=lambda _: True, needs=(), live_needs=needs,
            seconds=1.0, tell=tell,
        )  # fmt: skip

    monkeypatch.setattr(laboratory, "EXPERIMENTS", declared(experiment("1b", ()), experiment("2", ("1b",))))

    def run(folder: Path = tmp_path / "out") -> list[str]:
        made.clear()
        laboratory.run_laboratory((), "RIG.toml", 0, folder, live=live_stand(tmp_path / "RIG.toml"))
        return list(made)

    return tmp_path, run


def test_nothing_is_measured_twice(bench):
    _, run = bench
    assert run() == ["1b", "2"]
    assert run() == []


def test_who_builds_on_what_was_measured_again_is_made_again(bench):
    folder, run = bench
    run()
    (folder / "out" / "1b" / "chapter.json").unlink()
    assert run() == ["1b", "2"]


def test_another_limit_is_another_rig(bench):
    folder, run = bench
    run()
    (folder / "RIG.toml").write_text('kind = "twin"\nmake = "furuta"\nseed = 1\n', encoding="utf-8")
    assert run() == ["1b", "2"]
