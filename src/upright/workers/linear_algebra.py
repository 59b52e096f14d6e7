"""Linear algebra on one thread: matrices of a rig are small, so that threads wait for each other rather than compute.

Of twelve 10 x 10 exponentials two threads took 0.26 to 5.8 ms of two shared cores, one 0.07 ms. Sums, too, depend on
how many share them.
"""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from typing import Any


def limit_threads() -> Any:
    """Leave linear algebra one thread of this process from here on, or as long as what is given back is open."""
    import scipy.linalg  # brings a linear algebra of its own, which has to be there to be limited
    from threadpoolctl import threadpool_limits

    assert scipy.linalg
    return threadpool_limits(1, user_api="blas")


@contextmanager
def one_thread() -> Generator[None]:
    """Within it, or within a function that it decorates, linear algebra takes one thread of the whole process."""
    with limit_threads():
        yield
