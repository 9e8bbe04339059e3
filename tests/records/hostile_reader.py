"""Reads hostile inputs by their names, one a line, and says of each how it ended and what it took.

It runs in a process of its own, so that a test can end it, and so that memory counts from input to input.
"""

import json
import resource
import sys
import tempfile
import time
from pathlib import Path

import hostile_declarations
import hostile_files

CASES = {**hostile_declarations.CASES, **hostile_files.CASES}
HEADROOM = 6 * 2**30
"""Bytes of addresses beyond what the packages take: a test counts memory in use, this ends a runaway."""


def memory(field: str) -> int:
    """Gives bytes in use ("VmRSS"), or at their peak ("VmHWM"), of this process."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(field))


def tried(name: str, folder: Path) -> dict[str, object]:
    """Gives what came of an input: "read", or the exception and what it said."""
    read = CASES[name][0](folder)
    Path("/proc/self/clear_refs").write_text("5")  # the peak counts from here
    before, start, said, kind = memory("VmRSS"), time.perf_counter(), "", "read"
    try:
        read()
    except Exception as error:
        said, kind = str(error), type(error).__name__
    took = time.perf_counter() - start
    return {"kind": kind, "said": said, "seconds": took, "bytes": memory("VmHWM") - before}


def main() -> None:
    """Answers each name on the input with one line of JSON."""
    taken = memory("VmSize")
    resource.setrlimit(resource.RLIMIT_AS, (taken + HEADROOM, taken + HEADROOM))
    for line in sys.stdin:
        with tempfile.TemporaryDirectory() as folder:
            print(json.dumps(tried(json.loads(line), Path(folder))), flush=True)


if __name__ == "__main__":
    main()
