"""Does the doctor's page say what was found, with its unit, its picture and what to type next?"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from upright.diagnosis.chapter import chapter, finding_figure
from upright.diagnosis.findings import KINDS, Curve, Diagnosis, Finding, Panel
from upright.report.page import Code, Facts, Picture, Points

T = np.linspace(2.0, 4.0, 50)


def panels(late=0.0):
    return (
        Panel(label="x [mm]", curves=(Curve(name="x", t=T, y=7 * T),)),
        Panel(label="u [V]", curves=(
            Curve(name="u", t=T + late, y=T**2, style="steps"), Curve(name="v", t=T + late, y=-T, style="points"),
        )),
    )  # fmt: skip


def finding(severity="fault", **more):
    given = {
        "kind": "jump", "columns": ("x",), "sentence": "'x' jumps.", "advice": "Cut it.", "key": "window = 1",
        "evidence": {"jump [mm]": 12.3456, "jumps [1]": 2.0}, "panels": panels(), "marks": (3.0, 9.0),
        "spans": ((0.0, 2.5),),
    }  # fmt: skip
    return Finding(severity=severity, **(given | more))


def diagnosis(*findings, **more):
    given = {
        "file": "/logs/run.csv", "rig": "furuta", "samples": 1234, "duration": 5.6789, "checked": ("jump", "spike"),
        "unchecked": {"sign": "nobody said"},
    }  # fmt: skip
    return Diagnosis(findings=findings, **(given | more))


@pytest.mark.parametrize(
    ("severities", "verdict", "sound"),
    [
        ((), "Nothing wrong found.", True),
        (("note",), "Nothing wrong found.", True),
        (("fault",), "1 thing looks wrong.", False),
        (("fault", "warning", "note"), "2 things look wrong.", False),
    ],
)
def test_the_verdict_counts_faults_and_warnings(severities, verdict, sound):
    page = chapter(diagnosis(*(finding(s) for s in severities)), log=Path("run.csv"))
    assert (page.verdict, page.sound) == (verdict, sound)
    assert page.title == "What looks wrong with run.csv"
    assert page.detail == "1234 samples over 5.679 s, rig: furuta."
    assert [p.key or p.title for p in page.parts] == [
        *(f"finding-{i + 1}" for i in range(len(severities))), "Checked", "Not checked"
    ]  # fmt: skip
    assert page.parts[-2].content == (Points((f"{KINDS['jump']}; {KINDS['spike']}",)),)
    assert page.parts[-1].content == (Facts(((KINDS["sign"], "nobody said"),)),)


def test_a_finding_is_told_with_its_evidence_its_key_and_its_picture():
    part = chapter(diagnosis(finding()), log=Path("run.csv")).parts[0]
    facts, code, picture = part.content
    assert part.title == "fault: jump"
    assert facts == Facts((("Finding", "'x' jumps."), ("Evidence", "jump 12.35 mm, jumps 2."),
                            ("What to do", "Cut it.")))  # fmt: skip
    assert code == Code("window = 1")
    assert isinstance(picture, Picture)
    assert picture.caption.startswith("Dashed lines point at instants")
    bare = chapter(
        diagnosis(finding(advice="", key="", evidence={}, marks=(), spans=())), log=Path("a.csv")
    ).parts[0]  # fmt: skip
    assert bare.content[0] == Facts((("Finding", "'x' jumps."),))
    assert bare.content[1].caption == "The columns it is about."
    assert len(chapter(diagnosis(finding(panels=())), log=Path("a.csv")).parts[0].content) == 2
    checks = chapter(diagnosis(checked=(), unchecked={}), log=Path("a.csv")).parts
    assert [p.content for p in checks] == [(Points(("nothing",)),), ("Nothing.",)]


@pytest.mark.parametrize("name", ["![x](y)", "a](b", "[x]", "x|y", "## x", "- x"])
def test_a_column_s_name_is_no_markup(name):
    """Names of columns stand in sentences, reasons and file names, and a log may name them anything."""
    sentence = f"{name} jumps."
    page = chapter(diagnosis(finding(sentence=sentence), unchecked={"sign": sentence}, rig=name), log=Path("a.csv"))
    assert page.parts[0].content[0].pairs[0] == ("Finding", sentence)
    assert page.parts[-1].content == (Facts(((KINDS["sign"], sentence),)),)
    assert page.detail.endswith(f"rig: {name}.")


def test_what_to_type_next_names_log_rig_and_page():
    def steps(*found, page=True, rig="", rigs=()):
        told = chapter(diagnosis(*found, rigs=rigs), log=Path("run.csv"), rig=rig, page=page).steps
        return [step.command for step in told]

    init = "upright init run.csv -o study.toml"
    assert steps(finding()) == [init]
    assert steps(finding(), page=False) == ["upright doctor run.csv -o run-doctor.html", init]
    assert steps(finding(), page=False, rig="furuta") == [
        "upright doctor run.csv --rig furuta -o run-doctor.html", init,
    ]  # fmt: skip
    assert steps(page=False) == [init]
    assert steps(rigs=("furuta", "pendulum")) == ["upright doctor run.csv --rig furuta", init]
    assert steps(rigs=("furuta",), rig="pendulum") == [init]


def test_a_picture_draws_each_panel_with_its_marks_and_spans():
    drawing = finding_figure(finding())
    first, second = drawing.axes
    assert [ax.get_ylabel() for ax in (first, second)] == ["x [mm]", "u [V]"]
    named = [*(ax.yaxis.label for ax in drawing.axes), *second.get_legend().get_texts()]
    assert not any(text.get_parse_math() for text in named)  # a dollar in a column's name is a dollar
    (line, mark) = first.get_lines()
    drawn = {tuple(np.round(ln.get_xdata(), 6)): ln for ln in first.get_lines()}
    assert (3.0, 3.0) in drawn  # the mark at 9 s lies outside
    curve = next(ln for ln in (line, mark) if len(ln.get_xdata()) == 50)
    assert curve.get_ydata() == pytest.approx(7 * T)
    (span,) = first.patches
    assert (span.get_x(), span.get_x() + span.get_width()) == pytest.approx((2.0, 2.5))
    steps, points = (ln for ln in second.get_lines() if len(ln.get_xdata()) == 50)
    assert steps.get_drawstyle() == "steps-post"
    assert (points.get_marker(), points.get_linestyle()) == (".", "None")
    assert points.get_markersize() == 4
    assert first.get_legend() is None
    assert [t.get_text() for t in second.get_legend().get_texts()] == ["u", "v"]
    assert second.get_xlabel() == "time [s]"


def test_a_close_up_beside_a_whole_record_has_a_time_axis_of_its_own():
    same, other = finding_figure(finding()), finding_figure(finding(panels=panels(late=5.0)))
    assert [ax.xaxis.get_tick_params()["labelbottom"] for ax in same.axes] == [False, True]
    assert [ax.xaxis.get_tick_params()["labelbottom"] for ax in other.axes] == [True, True]
    assert other.axes[-1].get_xlabel() == "time [s]"
