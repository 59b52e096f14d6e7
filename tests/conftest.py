"""The public logs of real rigs are too large to come with the source: tests on them run where the logs are."""

import os

import pytest


def pytest_runtest_setup(item: pytest.Item) -> None:
    if item.get_closest_marker("real_data") and not os.path.isdir(os.environ.get("UPRIGHT_REAL_DATA", "")):
        pytest.skip("UPRIGHT_REAL_DATA does not name the folder of public logs")
