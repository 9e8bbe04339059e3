"""How many cores there are to share the work."""

import os


def usable_cores() -> int:
    """Give the number of cores that this process may use; of the machine where the system reports no more."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
