"""What a process of its own is asked to do in these tests; it imports nothing that takes time."""

from __future__ import annotations

import os
import signal
import threading

from upright.browser.identify.bounded import finish
from upright.errors import BadInput


def says(text, progress):
    progress("the only step", 0.5)
    return text


def refuses(sentence, progress):
    raise BadInput(sentence)


def eats(progress):
    return str(len(bytearray(64 << 30)))


def never_ends(progress):
    threading.Event().wait()
    return "it ended"


def ends_when_interrupted(progress):
    try:
        progress("waiting", 0.0)
        threading.Event().wait()
    except KeyboardInterrupt:
        finish()
        os.kill(os.getpid(), signal.SIGINT)  # of somebody who is impatient
        return "the best so far"


def draws(progress, show):
    try:
        while True:
            show([0.0] * 100_000)
    except KeyboardInterrupt:
        finish()
        show(["the last"])
        return "drawn"


def dies(progress):
    os.kill(os.getpid(), signal.SIGKILL)


def fails(progress):
    return [][1]
