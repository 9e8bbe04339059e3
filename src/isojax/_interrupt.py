"""Ctrl-C: one line and the end, also where threads compute or compile that cannot be stopped."""

import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

INTERRUPTED = 130
"""Exit code of a process that Ctrl-C ended: 128 + SIGINT, as shells give it."""

_PATIENCE = 2.0
"""Seconds after Ctrl-C in which the run may end by itself, which it cannot while a thread compiles."""

_CURSOR = "\r\x1b[2K\x1b[?25h"
"""Clears the live line of a terminal and shows its cursor again."""

_NEW_LINE = "\n"
"""Ends the line of the stage, which elsewhere is begun but not over."""


@contextmanager
def prompt_interrupt(words: Callable[[], str]) -> Iterator[None]:
    """End the process soon after Ctrl-C, even if what runs does not stop for it.

    The interpreter itself hears of a signal only between two of its steps, and a pool of threads waits for
    all of them. So a thread listens to the signal beside it. What is worth keeping is on disk already.

    Args:
        words: gives the line that is printed.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard, telling = socket.socketpair()
    telling.setblocking(False)
    over = threading.Event()

    def listen() -> None:
        while (told := heard.recv(1)) and told[0] != signal.SIGINT:
            pass
        if told and not over.wait(_PATIENCE):
            start = _CURSOR if sys.stderr.isatty() else _NEW_LINE
            os.write(2, f"{start}isojax: {words()}\n".encode())
            os._exit(INTERRUPTED)

    before = signal.set_wakeup_fd(telling.fileno(), warn_on_full_buffer=False)
    listener = threading.Thread(target=listen, daemon=True)
    listener.start()
    try:
        yield
    finally:
        over.set()
        signal.set_wakeup_fd(before)
        telling.close()
        listener.join()
        heard.close()
