"""What a process of its own does with a log, by names that cost the server nothing: each imports where it runs."""

from __future__ import annotations

from typing import Any


def begin_inspection(*arguments: Any) -> str:
    """See `reading.inspect_log`."""
    from upright.browser.identify import reading

    return reading.inspect_log(*arguments)


def begin_identification(*arguments: Any) -> str:
    """See `work.identify_log`."""
    from upright.browser.identify import work

    return work.identify_log(*arguments)


def begin_weighing(*arguments: Any) -> str:
    """See `weighed.weigh_body`."""
    from upright.browser.identify import weighed

    return weighed.weigh_body(*arguments)
