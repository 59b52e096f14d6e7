"""Does linear algebra take one thread where it is asked to, and as many as before after that?"""

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from upright.workers import one_thread


def threads():
    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


def test_linear_algebra_has_one_thread_within_and_its_former_number_after_an_error():
    import scipy.linalg

    assert scipy.linalg
    with threadpool_limits(2, user_api="blas"):
        before = threads()
        with pytest.raises(ZeroDivisionError):
            fails()
        assert threads() == before
        assert set(before) == {2}


@one_thread()
def fails():
    assert set(threads()) == {1}
    raise ZeroDivisionError
