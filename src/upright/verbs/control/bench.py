"""The laboratory in a browser: `bench`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from upright.errors import BadInput
from upright.verbs.command import command
from upright.verbs.pages import folder
from upright.verbs.values import path_of, paths

if TYPE_CHECKING:
    from upright.browser.serve import Bench
    from upright.files import PathLike


def _until_closed(bench: Bench) -> Iterator[str]:
    """What the command line says, and waits for."""
    from upright.browser.app import NOT_BUILT, is_built

    if not is_built():
        yield NOT_BUILT
    from signal import SIGTERM, default_int_handler, signal

    from upright.realtime.interrupts import ENDING, ignoring

    signal(SIGTERM, default_int_handler)
    if bench.instructor_url:
        yield f"Instructor of {len(bench.rigs)} students: {bench.instructor_url}"
        yield f"Students, each of whom chooses their name: {bench.url}"
        yield (
            "Open the first address yourself: it shows everybody, and stops everybody. Hand out the second one"
            f"{'' if bench.lan else '; only this machine is answered, others with --lan'}."
        )
        yield f"Logs and reports are kept in {bench.folder}, a folder for each student."
    else:
        yield f"{', '.join(bench.rigs)}: {bench.url}"
        yield f"Open this address in a browser; take control, then start. Logs and reports are kept in {bench.folder}"
    yield from (station.last_use.sentence for station in bench.stations if station.last_use is not None)
    yield "Ctrl-C stops every rig and closes the bench. Keep a stop in hardware within reach: this is software."
    try:
        bench.wait()
    except KeyboardInterrupt:
        with ignoring(ENDING):  # one is enough
            yield "Stopping every rig."
            bench.close()
    finally:
        bench.close()


@command(
    "Control",
    metavars={"rigs": "RIG.toml", "law": "DESIGN.json", "port": "N", "roster": "ROSTER.csv"},
    names={"law": "--law", "roster": "--class"},
    defaults={"out": "upright-bench"},
    ranges={"port": (0, 65535)},
    lines=_until_closed,
    more="""
    upright bench
    upright bench RIG.toml --law design.json
    upright bench RIG.toml --law design.json --lan     other machines too, with the token that it prints
    upright bench --class roster.csv --lan             a twin for each student, and a page that shows them all
    """,
)
def bench(
    rigs: Sequence[PathLike] | PathLike | None = None, *, law: Sequence[PathLike] | PathLike | None = None,
    roster: PathLike | None = None, port: int = 8431, lan: bool = False, browser: bool = True, fifo: bool = True,
    out: PathLike | None = None,
) -> Bench:  # fmt: skip
    """Open the laboratory in a browser: start, tap and stop rigs, drag their poles, keep their runs.

    One person operates a rig, others watch; anybody stops it. Without a RIG.toml there is a twin of the Furuta
    pendulum, which moves in real time.

    Parameters
    ----------
    rigs : path or sequence of path, optional
        RIG.toml of each rig.
    law : path or sequence of path, optional
        design.json for each rig, in their order; twins without one have one proposed.
    roster : path, optional
        Names of a class, a line each below a header ``name``, with a ``seed`` where wanted: each has a twin of their
        own.
    port : int
        Of the address; 0 for any that is free.
    lan : bool
        Answer other machines of the network, which need the token in the printed address.
    browser : bool
        Open the page in this machine's browser.
    fifo : bool
        Ask for real-time priority of the loops.
    out : path
        Folder for logs and reports.

    Returns
    -------
    Bench
        With its `url`; it runs until `close`.

    Raises
    ------
    BadInput
        When a file cannot be used, the port is taken, or the bench extra is not installed.
    """
    if out is None:
        raise BadInput("the logs of runs are kept: name a folder for them, such as out='bench'.")
    given: Any = port
    if isinstance(given, bool) or not isinstance(given, int) or not 0 <= port <= 65535:
        raise BadInput(f"a port is a number from 0 to 65535, got {port!r}.")
    rig_files = [path_of(rig, "a rig of the bench") for rig in paths(rigs)]
    laws = [path_of(each, "the law of a rig") for each in paths(law)]
    kept = folder(out)
    try:
        from upright.browser.serve import open_bench
    except ImportError as error:
        raise BadInput(
            f"the bench needs the bench extra ({error.name} is not installed): pip install 'upright[bench]'."
        ) from None
    names = None if roster is None else path_of(roster, "the list of a class")
    opened = open_bench(rig_files, laws, kept, port=port, lan=lan, roster=names, fifo=fifo)
    if browser:
        import webbrowser

        webbrowser.open(opened.instructor_url or opened.url)
    return opened
