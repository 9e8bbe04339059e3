"""How many cores there are to share the work, who shares it, and the memory that it leaves."""

import contextlib
import ctypes
import functools
import os
import threading
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
        The function; when the last thread in it is done BLAS has as many threads as before.
    """

    @functools.wraps(work)
    def alone(*args: _Given.args, **kwargs: _Given.kwargs) -> _Answer:
        with _one_thread:
            return work(*args, **kwargs)

    return alone


class _OneThread:
    """Holds BLAS to one thread from the first of all threads that enter to the last that leaves."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = 0
        self._held = contextlib.ExitStack()

    def __enter__(self) -> None:
        with self._lock:
            if self._inside == 0:
                self._held.enter_context(ThreadpoolController().limit(limits=1, user_api="blas"))
            self._inside += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0:
                self._held.close()


_one_thread = _OneThread()


def give_memory_back() -> None:
    """Give freed memory back to the system; glibc keeps it for each thread, where no other finds it.

    Where there is another C library nothing is done.
    """
    try:
        library = ctypes.CDLL("libc.so.6")
    except OSError:
        return
    library.malloc_trim(0)
