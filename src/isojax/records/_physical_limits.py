"""Limits that a number of a vibration test keeps; beyond them arithmetic overflows."""

from typing import NamedTuple


class Limits(NamedTuple):
    """The least and the greatest size of a number."""

    least: float
    most: float

    @property
    def words(self) -> str:
        """Both, in words."""
        return f"of {self.least:g} to {self.most:g}"

    def hold(self, number: float) -> bool:
        """Says whether a number above 0 lies between them; NaN does not."""
        return self.least <= number <= self.most


SIZE = Limits(1e-30, 1e30)
"""Of a sample in SI, and of whatever has no limits of its own: the fourth power of it is still a number."""

MASS = Limits(1e-9, 1e9)
GAIN = Limits(1e-15, 1e15)
RATE = Limits(1e-6, 1e10)
"""Samples or cycles per second [Hz]."""

TIME = Limits(0.0, 1e12)
"""A time, or cycles, from the start of a record or of a calendar [s]."""

SHARE = Limits(1e-12, 1.0)
COUNT = Limits(0.0, 2.0**53)
ORDER = Limits(1.0, 20.0)
"""Of a filter: analogue ones have up to 12 poles, anti-alias filters of a converter act like 20."""
