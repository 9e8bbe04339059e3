"""The contract of a force law of the simulated plant: m x'' + sum of forces = F(t)."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, no_type_check

Switch = Callable[[Any, Any, Any], Any]
"""A function of displacement, velocity and internal states whose zero marks a kink or a jump of a law."""


@no_type_check
def displacement(x, v, z):
    """Zero where the plant passes its centre."""
    return x


@no_type_check
def velocity(x, v, z):
    """Zero where the motion turns."""
    return v


@dataclass(frozen=True)
class Stretch:
    """The part of a test that a record is.

    Args:
        begin: share of the test, 0 to 1, that is over when the record begins.
        end: the same when it ends.
        seconds: length of the record; its time starts at 0.
        pressure: in the chamber, Pa; None where it is not recorded.
    """

    begin: float
    end: float
    seconds: float
    pressure: float | None = None


class Law(ABC):
    """One physical effect in the force balance.

    A law is smooth between the zeros of its `switches`. The integrator ends a step at each zero and hands the
    law the sign that every switch has on the present side, so that a trial step beyond the zero still sees
    the smooth continuation. The methods take floats inside the integrator and arrays (time,) when a record is
    evaluated, so they use operators that both have. They are called a few thousand times per simulated second
    and therefore carry no runtime type check.

    Subclasses are frozen dataclasses whose fields are the law's coefficients in SI units.
    """

    name: ClassVar[str]
    """Catalogue name, as in campaign.toml."""
    inner: ClassVar[int] = 0
    """Number of internal states."""
    speeds: ClassVar[tuple[int, ...]] = ()
    """Which of the internal states are speeds of masses, so that a floor that moves pushes them, too."""
    moves_floor: ClassVar[bool] = False
    """Whether the law moves the floor under the plant; the state is then relative to the floor."""

    @property
    def switches(self) -> tuple[Switch, ...]:
        """Functions of (x, v, z) at whose zeros the law has a kink or a jump."""
        return ()

    @property
    def inertia(self) -> float:
        """Mass that the law adds to the moving mass, kg."""
        return 0.0

    @property
    def holding(self) -> tuple[float, float]:
        """Lowest and highest force with which the law can hold the plant at rest, N; 0 without stiction."""
        return 0.0, 0.0

    @no_type_check
    @abstractmethod
    def force(self, t, x, v, z, s):
        """Force that resists the motion, N.

        Args:
            t: time, s.
            x: displacement, m.
            v: velocity, m/s.
            z: internal states, one entry each.
            s: sign (+1 or -1) of each switch on the present side.
        """

    @no_type_check
    def rate(self, t, x, v, z, s):
        """Time derivative of each internal state, a tuple as long as `inner`."""
        return ()

    @no_type_check
    def floor(self, t):
        """Acceleration of the floor, m/s^2."""
        return 0.0

    @no_type_check
    def floor_sensor(self, t):
        """What an accelerometer on the floor shows, m/s^2; None where there is none."""
        return None

    @no_type_check
    def placed(self, stretch, draw):
        """The law in one record of a test.

        Args:
            stretch: the `Stretch` of the test that the record is.
            draw: random numbers of the record.
        """
        return self

    @no_type_check
    def drifted(self, scale):
        """The law when the rig's linear stiffness has drifted by a factor `scale`."""
        return self
