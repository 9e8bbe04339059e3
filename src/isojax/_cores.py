"""How many cores there are to share the work, and who shares it."""

import functools
import os
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from threadpoolctl import ThreadpoolController

_Given = ParamSpec("_Given")
_Answer = TypeVar("_Answer")


def usable_cores() -> int:
    """Give the number of cores that this process may use; of the machine where the system reports no more."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def blas_in_one_thread(work: Callable[_Given, _Answer]) -> Callable[_Given, _Answer]:
    """Have NumPy and SciPy multiply matrices in the caller's own thread while a function runs.

    isojax shares its work among threads itself, and its matrices are small. Threads that BLAS adds only wait
    for each other: beside another process a product takes 30 times as long with them.

    Args:
        work: the function.

    Returns:
        The function; when it returns BLAS has as many threads as before.
    """

    @functools.wraps(work)
    def alone(*args: _Given.args, **kwargs: _Given.kwargs) -> _Answer:
        with ThreadpoolController().limit(limits=1, user_api="blas"):
            return work(*args, **kwargs)

    return alone
