"""How many cores there are to share the work, who shares it, and the memory that it takes and leaves."""

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


def in_own_threads(work: Callable[_Given, _Answer]) -> Callable[_Given, _Answer]:
    """Make room for a function that shares its work among threads of its own.

    While it runs, NumPy and SciPy multiply matrices in the caller's own thread: the matrices are small, and
    threads that BLAS adds only wait for each other. Beside another process a product takes 30 times as long
    with them. From then on, threads may use the memory that others freed.

    Args:
        work: the function.

    Returns:
        The function; when the last thread in it is done BLAS has as many threads as before.
    """

    @functools.wraps(work)
    def alone(*args: _Given.args, **kwargs: _Given.kwargs) -> _Answer:
        _share_freed_memory()
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


_ARENA_MAX = -8
"""`M_ARENA_MAX` of glibc's malloc.h."""

_ARENAS = 2
"""Pools of memory of the process; a single one would take two per cent less."""


@functools.cache
def _share_freed_memory() -> None:
    """Have the threads of the process take memory from few pools.

    The allocator of glibc keeps up to eight pools a core, and what is free in one serves no other. With few a
    loop over long records takes a sixth less memory.

    Where `MALLOC_ARENA_MAX` is set, or there is another C library, nothing is done.
    """
    library = _glibc()
    if library is not None and "MALLOC_ARENA_MAX" not in os.environ:
        library.mallopt(_ARENA_MAX, _ARENAS)


def give_memory_back() -> None:
    """Give freed memory back to the system, which glibc keeps.

    Where there is another C library nothing is done.
    """
    library = _glibc()
    if library is not None:
        library.malloc_trim(0)


def _glibc() -> ctypes.CDLL | None:
    try:
        return ctypes.CDLL("libc.so.6")
    except OSError:
        return None
