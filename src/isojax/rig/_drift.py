"""A spring that changes in the course of the test."""

from dataclasses import dataclass, field, replace
from typing import ClassVar, no_type_check

from ._law import Law


@dataclass(frozen=True)
class StiffnessDrift(Law):
    """f = change tau x, with tau the share of the test that is over; the records follow without a pause.

    Args:
        change: of the linear stiffness from the start of the test to its end, N/m.
    """

    name: ClassVar[str] = "stiffness_drift"
    change: float
    _clock: tuple[float, float] | None = field(default=None, repr=False)

    @no_type_check
    def placed(self, stretch, draw):
        """The spring in one record of the test."""
        return replace(self, _clock=(stretch.begin, (stretch.end - stretch.begin) / stretch.seconds))

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`.

        Raises:
            ValueError: if it is not known where in the test that is.
        """
        if self._clock is None:
            raise ValueError("A StiffnessDrift must be placed in a test before it acts; `rig.run` does that.")
        begin, rate = self._clock
        return self.change * (begin + rate * t) * x
