"""A browser for the tests of a file that need one."""

from __future__ import annotations

import pytest

from tests.browser.students import browser


@pytest.fixture(scope="module")
def chromium():
    with browser() as opened:
        yield opened
