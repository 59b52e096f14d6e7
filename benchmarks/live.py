"""How fast does a rig move in a page: its kernel beside the native one, the answer of 200 rigs, pictures a second?

One motion of 5 s at 1 kHz (Furuta pendulum, dry friction on both joints, counts, sampled law) in Node, beside the same
kernel as machine code of this processor; then the page of `upright play` in Chromium: the answer of 200 rigs of 3 s to
a change, by the clock on the wall and with as many workers as there are processors, and pictures a second meanwhile.
Last, the traces of a run of 1,000,000 samples beside those of one of 10,000: written, first drawn, zoomed.
"""

from __future__ import annotations

import json
import math
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.measure import Line, Target, spread

POLES = "-4.5+-2j, -20, -3"
ANSWER, FRAMES, PAGE, RATIO = 0.05, 55.0, 150_000, 1.5
"""Asked: seconds to an answer, pictures a second, bytes of the page, times the native kernel."""

TIMED = """
const k = new Kernel(given.kernel), best = [];
for (let i = 0; i < given.rounds; i++) {
  const before = process.cpuUsage();
  for (let j = 0; j < given.each; j++) k.run();
  const used = process.cpuUsage(before);
  best.push((used.user + used.system) / 1e6 / given.each);
}
process.stdout.write(JSON.stringify(best));
"""


ENSEMBLE = """
const ensemble = new Ensemble(DATA), twin = new Twin(DATA), used = [];
for (let i = 0; i < ROUNDS; i++) {
  twin.set({friction: 1 + i / 100});
  const before = process.cpuUsage();
  ensemble.words(twin.settings, twin.gains);
  const after = process.cpuUsage(before);
  used.push((after.user + after.system) / 1e6);
}
process.stdout.write(JSON.stringify(used.slice(3)));
"""


ANSWERS = """(async (answers) => {
  const first = (tell) => upright.answered.length ? tell() : requestAnimationFrame(() => first(tell));
  await new Promise(first);
  upright.answered.length = 0;
  for (let i = 0; i < answers; i++) {
    upright.twin.set({friction: 1 + i / 100});
    await upright.answer();
  }
  return upright.answered;
})"""
PAINTED = """new Promise((tell) => new PerformanceObserver((entries) => {
  const [first] = entries.getEntriesByName("first-contentful-paint");
  if (first) tell(first.startTime);
}).observe({ type: "paint", buffered: true }))"""
"""The page's first picture [ms], once the browser has shown it."""
PICTURES = """new Promise((tell) => {
  const k = upright.frames, t = performance.now();
  const look = () => performance.now() - t > 3000 ? tell((upright.frames - k) / 3) : requestAnimationFrame(look);
  look();
})"""


ZOOMS = """(async () => {
  const picture = () => new Promise(requestAnimationFrame), zooms = [];
  document.querySelector("figure:has(script.traces)").scrollIntoView();
  while (!(TRACES.length && TRACES[0].plots[0].bbox.width > 0)) await picture();
  const drawn = performance.now();
  for (let i = 0; i < 20; i++) {
    const begun = performance.now();
    TRACES[0].zoom(i % 10 < 5 ? 0.5 : 2);
    await picture();
    await picture();
    zooms.push((performance.now() - begun) / 1000);
  }
  return { drawn: drawn / 1000, zooms, samples: TRACES[0].t.length };
})()"""


def rig() -> Any:
    """A rig of the size of a laboratory's."""
    import upright as up

    arm = up.Furuta(m_p=0.135, l_cg=0.19, r=0.16, J_d=0.011, J_p=6e-4, b_1=0.003, b_2=2e-4, b_1c=0.008, b_2c=3e-4)
    return up.Rig.known(arm, name="bench", gain="0.65 N m/V", limit="5 V", period="1 ms", counts=4096)


def motion(rounds: int) -> tuple[list[float], list[float], int]:
    """CPU seconds of one motion of 5 s, natively and in Node, and the bytes of its module."""
    import numpy as np

    from upright.laws import state_feedback
    from upright.live import SCRIPTS
    from upright.live.kernel import described
    from upright.simulation import Simulator, choose

    plant = rig().plant
    law = state_feedback([0.2, 0.3, 3.0, 0.5], 1e-3, memory=0.7, target=[0.0, math.pi], resolution=1e-3)
    values = dict(plant.parameters())
    derived = plant.derived_for(values)
    simulator = Simulator(derived=derived, flavour=choose(derived, values, loop=law), dt=1e-3, loop=law)
    table, x0 = simulator.table(values, 1), np.array([[0.0], [0.0], [math.pi + 0.1], [0.0]])
    simulator.run(table, x0, samples=5001)
    here: list[float] = []
    for _ in range(rounds):
        before = time.process_time()
        for _ in range(20):
            simulator.run(table, x0, samples=5001)
        here.append((time.process_time() - before) / 20)
    kernel = described(simulator, simulator.call(table, x0, samples=5001, width=1), width=1)
    script = SCRIPTS[0].read_text(encoding="utf-8")
    body = f"{script}\nconst given = JSON.parse(require('fs').readFileSync(0, 'utf8'));\n{TIMED}"
    node = subprocess.run(
        ["node", "-e", body], input=json.dumps({"kernel": kernel, "rounds": rounds, "each": 20}),
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return here, json.loads(node.stdout), len(simulator.wasm(1).code)


def ensemble(path: Path, rounds: int) -> list[float]:
    """CPU seconds in which one processor answers for all rigs of a page, by its own script in Node."""
    script = path.read_text(encoding="utf-8").partition('<script id="script">')[2].partition("/* the page begins */")[0]
    body = f"const ROUNDS = {rounds + 3};\n{script}\n{ENSEMBLE}"
    with tempfile.NamedTemporaryFile("w", suffix=".js", encoding="utf-8") as file:
        file.write(body)
        file.flush()
        node = subprocess.run(["node", file.name], capture_output=True, text=True, check=True)
    return json.loads(node.stdout)


def page(path: Path, answers: int) -> dict[str, Any]:
    """What a browser measures of a page."""
    from playwright.sync_api import sync_playwright

    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    with sync_playwright() as runner:
        opened = runner.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        tab = opened.new_page()
        tab.goto(path.as_uri())
        first = tab.evaluate(PAINTED)
        times = tab.evaluate(f"{ANSWERS}({answers})")
        frames = tab.evaluate(PICTURES)
        opened.close()
    return {"answers": [1e-3 * t for t in times], "frames": frames, "first": 1e-3 * first}


def write_long(path: Path, samples: int) -> float:
    """CPU seconds in which the page of a run of so many samples is written, a millisecond each."""
    import numpy as np

    from upright.identification import RunScore
    from upright.report.fit.figures import fit_figure
    from upright.report.fit.interactive import score_traces
    from upright.report.html import write_html
    from upright.report.page import Chapter, Part, Picture

    t, arm = np.arange(samples) * 1e-3, rig().plant
    model = np.column_stack([0.4 * np.sin(2 * t), np.cos(7 * t) * np.exp(-0.002 * t)])
    measured = model + 1e-3 * np.random.default_rng(0).standard_normal(model.shape)
    score = RunScore(
        role="predict", fit_percent={"psi": 99.0, "theta": 99.0}, horizon=None, t=t, y=measured, simulated=model,
        measured=("psi", "theta"),
    )  # fmt: skip
    drawn = Picture(
        name="run", draw=lambda: fit_figure(score, arm, title="run"), caption="A run.", description="A run.",
        interactive=lambda: score_traces({"model": score}, type(arm), name="run"),
    )  # fmt: skip
    before = time.process_time()
    write_html(path, Chapter(title="A run", verdict="", parts=(Part("Run", (drawn,)),)))
    return time.process_time() - before


def long_runs(folder: Path, rounds: int) -> list[Line]:
    """Traces of a million samples beside those of ten thousand."""
    lines: list[Line] = []
    for samples in (10_000, 1_000_000):
        path = folder / f"{samples}.html"
        write_long(path, samples)  # what is imported once
        written = [write_long(path, samples) for _ in range(rounds)]
        seen = [visited(path, ZOOMS) for _ in range(rounds)]
        note = f"{path.stat().st_size:,} bytes, {seen[0]['samples']:,} of {samples:,} samples"
        lines.append(Line(contender=f"page of {samples:,} samples, written", seconds=spread(written), note=note))
        lines.append(Line(contender="its traces, first drawn", seconds=spread([s["drawn"] for s in seen])))
        lines.append(Line(contender="and zoomed", seconds=spread([z for s in seen for z in s["zooms"]])))
    return lines


def visited(path: Path, script: str) -> Any:
    """What a script answers in a page that a browser has opened."""
    from playwright.sync_api import sync_playwright

    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    with sync_playwright() as runner:
        opened = runner.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        tab = opened.new_page()
        tab.goto(path.as_uri())
        answer = tab.evaluate(script)
        opened.close()
    return answer


def run(*, quick: bool, progress: Callable[[str], None]) -> list[Line]:
    """Kernel, page, browser; what is missing here is said."""
    import upright as up

    lines: list[Line] = []
    progress("one motion")
    if shutil.which("node"):
        here, there, size = motion(3 if quick else 9)
        lines.append(Line(contender="native kernel, 5 s at 1 kHz", seconds=spread(here)))
        ratios = [b / a for a, b in zip(here, there, strict=True)]
        lines.append(
            Line(contender="the same in Node", seconds=spread(there), ratio=spread(ratios),
                 target=Target(most=RATIO), note=f"module of {size:,} bytes")
        )  # fmt: skip
    else:
        lines.append(Line(contender="the same in Node", note="Node is missing"))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "play.html"
        progress("the page")
        played = up.play(rig(), poles=POLES, out=path)
        size = path.stat().st_size
        if shutil.which("node"):
            used = spread(ensemble(path, 5 if quick else 20))
            lines.append(Line(contender="200 rigs of 3 s in Node, one processor", seconds=used, note="its CPU time"))
        note = f"{size:,} bytes (at most {PAGE:,} asked), {played.numbers['held']} of 200 rigs stabilised"
        try:
            seen = page(path, 5 if quick else 20)
        except (ImportError, StopIteration):
            return [*lines, Line(contender="the page", note=f"{note}; Playwright or Chromium is missing")]
        lines.append(
            Line(contender="200 rigs of 3 s answer in Chromium", seconds=spread(seen["answers"]),
                 target=Target(most=ANSWER, of="seconds"), note=note)
        )  # fmt: skip
        lines.append(
            Line(contender="first picture", seconds=spread([seen["first"]]), target=Target(most=0.3, of="seconds"),
                 note=f"{seen['frames']:.0f} pictures a second (at least {FRAMES:.0f} asked)")
        )  # fmt: skip
        progress("long runs")
        lines += long_runs(Path(folder), 2 if quick else 5)
    return lines
