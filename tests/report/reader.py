"""What a person, a screen reader or a program meets on a page."""

from __future__ import annotations

from html.parser import HTMLParser

VOID = {"meta", "link", "br", "hr", "img", "input"}


class Page(HTMLParser):
    """Collects text, attributes and ids, and insists that what opens also closes, in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open, self.text, self.attributes, self.ids, self.tags = [], [], [], [], []
        self.tables: list[list[list[tuple[str, str]]]] = []
        """Rows of every table, each cell as what it is (`th col`, `th row`, `td`) and its text."""
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, k, v or "") for k, v in attrs]
        self.ids += [v for k, v in attrs if k == "id"]
        if tag not in VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("th", "td"):
            self.tables[-1][-1].append((f"{tag} {dict(attrs).get('scope', '')}".strip(), ""))

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if not self.open or self.open[-1] in ("style", "script"):
            return
        self.text.append(data)
        if {"th", "td"} & set(self.open):
            kind, before = self.tables[-1][-1].pop()
            self.tables[-1][-1].append((kind, before + data))

    @property
    def prose(self) -> str:
        """All that can be read, blanks as one."""
        return " ".join(" ".join(self.text).split())

    def named(self, tag: str, attribute: str) -> list[str]:
        """What an attribute says wherever a tag has it."""
        return [v for t, k, v in self.attributes if (t, k) == (tag, attribute)]
