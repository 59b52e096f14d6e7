"""What has come into a log since it was last looked at?"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from upright.errors import BadInput
from upright.files import PathLike, regular
from upright.logs.container import Container, Damaged
from upright.logs.header import LogHeader
from upright.logs.whole import Columns, Rows, RunEvent, header_of


@dataclass(frozen=True, kw_only=True)
class Fresh:
    """Rows and events of one further chunk, and the header that names them."""

    header: LogHeader
    columns: Columns
    events: tuple[RunEvent, ...]


def follow(path: PathLike, wait: Callable[[], bool]) -> Iterator[Fresh]:
    """Rows of a log as they reach its file, from the first on, until its writer ends it.

    Parameters
    ----------
    path : path
        Log that may still be being written.
    wait : callable
        Called when nothing new is there; lets some time pass and answers whether to go on.

    Raises
    ------
    BadInput
        When it is no log of a run, or is damaged.
    """
    regular(path)
    container = Container()
    with open(path, "rb") as file:
        while not container.ended:
            file.seek(container.at)
            rows, before = Rows(), container.at
            try:
                for messages in container.read(file.read()):
                    reported = len(rows.events)
                    columns = rows.add(container, messages)
                    header = header_of(container, str(path))
                    yield Fresh(header=header, columns=columns, events=tuple(rows.events[reported:]))
            except Damaged as damage:
                raise BadInput(f"'{path}' is damaged at byte {damage.at}: {damage}; see upright log recover.") from None
            if container.at == before and not wait():
                return
