"""The public logs of real rigs are too large to come with the source: tests on them run where the logs are."""

import gc
import os
import time

# The matrices here are small: threads of the linear algebra only wait for each other and for other tests.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Nobody can answer here whether a plant of a test's own may run; what is asked is tested where this is taken away.
os.environ.setdefault("UPRIGHT_ALLOW_CODE", "1")

import pytest

# Ten thousand tests and the trees of their files stay to the end: looking through them again and again is a seventh of
# the processor's time.
gc.disable()


def pytest_collection_finish() -> None:
    gc.collect()
    gc.freeze()
    gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Name what failed at once: a run that is ended from outside prints no summary."""
    if report.failed and "PYTEST_XDIST_WORKER" not in os.environ:
        print(f"\nFAILED {report.nodeid} ({report.when}, {report.duration:.0f} s)", flush=True)


UNTIL = float(os.environ.get("UPRIGHT_TESTS_UNTIL", "inf"))
"""Time [s since 1970] after which no slow test begins: `.ci/run` has to come to its end on a slow machine too."""


def pytest_runtest_setup(item: pytest.Item) -> None:
    if time.time() > UNTIL and item.get_closest_marker("slow"):
        pytest.skip("left out, since the time for slow tests is over on this machine")
    if item.get_closest_marker("real_data") and not os.path.isdir(os.environ.get("UPRIGHT_REAL_DATA", "")):
        pytest.skip("UPRIGHT_REAL_DATA does not name the folder of public logs")
