"""Marks of a benchmark: PASS or FAIL beside each, and the exit status."""

import sys


class Marks:
    """What was judged so far."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self.met = True

    def judge(self, words: str, met: bool) -> None:
        """Print a figure with its verdict."""
        self.met &= bool(met)
        print(f"{'PASS' if met else 'FAIL'}  {words}", flush=True)

    def leave(self) -> None:
        """End with code 1 after a FAIL."""
        sys.exit(not self.met)
