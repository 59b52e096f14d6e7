"""How is a chapter kept on disk, so that a report can be finished another day?"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from markupsafe import Markup

from upright.json_file import plain_values
from upright.report.advice import Step
from upright.report.chapter import Chapter, Finding
from upright.report.document import Picture
from upright.report.sections import Part, Table


def as_plain(chapter: Chapter) -> dict[str, Any]:
    """A chapter as values that JSON can hold."""
    return {
        "key": chapter.key,
        "title": chapter.title,
        "question": chapter.question,
        "verdict": chapter.verdict,
        "detail": chapter.detail,
        "sound": chapter.sound,
        "parts": [_part(p) for p in chapter.parts],
        "steps": [{"sentence": s.sentence, "command": s.command} for s in chapter.steps],
        "findings": [
            {"what": f.what, "value": f.value, "interval": f.interval, "truth": f.truth} for f in chapter.findings
        ],
        "numbers": plain_values(chapter.numbers),
    }


def from_plain(content: Mapping[str, Any]) -> Chapter:
    """The chapter that `as_plain` wrote."""
    return Chapter(
        key=content["key"],
        title=content["title"],
        question=content["question"],
        verdict=content["verdict"],
        detail=content["detail"],
        sound=content["sound"],
        parts=tuple(_part_from(p) for p in content["parts"]),
        steps=tuple(Step(**s) for s in content["steps"]),
        findings=tuple(Finding(**f) for f in content["findings"]),
        numbers=content["numbers"],
    )


def _part(part: Part) -> dict[str, Any]:
    return {
        "title": part.title,
        "sentences": [_text(s) for s in part.sentences],
        "formulas": [str(f) for f in part.formulas],
        "tables": [
            {
                "caption": t.caption,
                "headings": [_text(h) for h in t.headings],
                "rows": [[_text(cell) for cell in row] for row in t.rows],
                "numbers": list(t.numbers),
            }
            for t in part.tables
        ],
        "pictures": [
            {"markup": str(p.markup), "caption": p.caption, "description": p.description} for p in part.pictures
        ],
    }


def _part_from(content: Mapping[str, Any]) -> Part:
    return Part(
        title=content["title"],
        sentences=tuple(_text_from(s) for s in content["sentences"]),
        formulas=tuple(Markup(f) for f in content["formulas"]),
        tables=tuple(
            Table(
                caption=t["caption"],
                headings=tuple(_text_from(h) for h in t["headings"]),
                rows=tuple(tuple(_text_from(cell) for cell in row) for row in t["rows"]),
                numbers=tuple(t["numbers"]),
            )
            for t in content["tables"]
        ),
        pictures=tuple(
            Picture(markup=Markup(p["markup"]), caption=p["caption"], description=p["description"])
            for p in content["pictures"]
        ),
    )


def _text(text: str) -> Any:
    return {"markup": str(text)} if isinstance(text, Markup) else str(text)


def _text_from(content: Any) -> str:
    return Markup(content["markup"]) if isinstance(content, dict) else content
