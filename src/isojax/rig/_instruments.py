"""Effects of the instruments: what is recorded is not quite what acts on the plant and how it answers.

With every instrument in place, acting force(t) = (1 + gain deviation) x recorded force(t - delay) + offset,
and recorded output = (1 + gain deviation) x output + offset, less what coupling and range take away.
"""

from abc import ABC
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from ._force_pieces import ForcePiece
from ._law import Stretch


class Instrument(ABC):
    """One effect between the plant and the file; acts on the fine grid, before the anti-alias filter."""

    name: ClassVar[str]
    """Catalogue name, as in campaign.toml."""

    @property
    def lag(self) -> float:
        """Time by which the acting force lags the recorded one, s."""
        return 0.0

    def placed(self, stretch: Stretch, draw: np.random.Generator) -> "Instrument":
        """The instrument in one record of a test; `draw` gives the record's random numbers."""
        return self

    def acting(self, pieces: Sequence[ForcePiece], rate: float) -> Sequence[ForcePiece]:
        """The force that acts where these pieces are recorded, `rate` samples a second; see `lag`."""
        return pieces

    def recorded_force(
        self, times: Float[np.ndarray, " time"], force: Float[np.ndarray, " time"]
    ) -> Float[np.ndarray, " time"]:
        """What the force channel shows of the force, N."""
        return force

    def recorded_output(
        self, times: Float[np.ndarray, " time"], output: Float[np.ndarray, " time"]
    ) -> Float[np.ndarray, " time"]:
        """What the output channel shows of the output, in its SI unit."""
        return output


@dataclass(frozen=True)
class InputDelay(Instrument):
    """The force acts `delay` seconds after it is recorded."""

    name: ClassVar[str] = "input_delay"
    delay: float

    @property
    def lag(self) -> float:
        """The delay, s."""
        return self.delay


@dataclass(frozen=True)
class InputGain(Instrument):
    """The acting force is (1 + deviation) times the recorded one."""

    name: ClassVar[str] = "input_gain"
    deviation: float

    def recorded_force(
        self, times: Float[np.ndarray, " time"], force: Float[np.ndarray, " time"]
    ) -> Float[np.ndarray, " time"]:
        """The force over (1 + deviation), N."""
        return force / (1 + self.deviation)


@dataclass(frozen=True)
class InputOffset(Instrument):
    """The acting force is the recorded one plus `force` newtons."""

    name: ClassVar[str] = "input_offset"
    force: float

    def recorded_force(
        self, times: Float[np.ndarray, " time"], force: Float[np.ndarray, " time"]
    ) -> Float[np.ndarray, " time"]:
        """The force less the offset, N."""
        return force - self.force


@dataclass(frozen=True)
class SensorGain(Instrument):
    """The output channel shows (1 + deviation) times the output."""

    name: ClassVar[str] = "sensor_gain"
    deviation: float

    def recorded_output(
        self, times: Float[np.ndarray, " time"], output: Float[np.ndarray, " time"]
    ) -> Float[np.ndarray, " time"]:
        """The output times (1 + deviation)."""
        return output * (1 + self.deviation)


@dataclass(frozen=True)
class SensorOffset(Instrument):
    """The output channel shows the output plus `value`, in the SI unit of the output."""

    name: ClassVar[str] = "sensor_offset"
    value: float

    def recorded_output(
        self, times: Float[np.ndarray, " time"], output: Float[np.ndarray, " time"]
    ) -> Float[np.ndarray, " time"]:
        """The output plus the offset."""
        return output + self.value


@dataclass(frozen=True)
class AcCoupling(Instrument):
    """The output channel is AC coupled: an RC high-pass of first order, discharged at the first instant.

    The capacitor is followed exactly along straight lines between points of a spline, eight to a step.

    Args:
        corner: Hz.
    """

    name: ClassVar[str] = "ac_coupling"
    corner: float

    def recorded_output(
        self, times: Float[np.ndarray, " time"], output: Float[np.ndarray, " time"]
    ) -> Float[np.ndarray, " time"]:
        """The output less the voltage of the capacitor."""
        between = 8
        step = (times[1] - times[0]) / between
        fine = times[0] + step * np.arange(between * (times.size - 1) + 1)
        values = CubicSpline(times, output)(fine)
        a = 2 * np.pi * self.corner * step
        # Voltage after a straight line from the old to the new value, from the old voltage.
        kept, mean = np.exp(-a), -np.expm1(-a) / a
        discharged = [-(1 - mean) * values[0]]
        capacitor = lfilter([1 - mean, mean - kept], [1, -kept], values, zi=discharged)[0]
        return output - capacitor[::between]


@dataclass(frozen=True)
class Clipping(Instrument):
    """The output channel saturates at +-level, or at -lower and +level, in the SI unit of the output."""

    name: ClassVar[str] = "clipping"
    level: float
    lower: float | None = None

    def recorded_output(
        self, times: Float[np.ndarray, " time"], output: Float[np.ndarray, " time"]
    ) -> Float[np.ndarray, " time"]:
        """The output within the range."""
        return np.clip(output, -(self.level if self.lower is None else self.lower), self.level)


@dataclass(frozen=True)
class ClockSkew(Instrument):
    """The clock of the output channel runs fast: what it files under t it saw at t / (1 + skew).

    Both start with the record. The output between the instants of the fine grid is that of a spline.

    Args:
        skew: 1; 1e-6 is one ppm.
    """

    name: ClassVar[str] = "clock_skew"
    skew: float

    def recorded_output(
        self, times: Float[np.ndarray, " time"], output: Float[np.ndarray, " time"]
    ) -> Float[np.ndarray, " time"]:
        """The output as the other clock files it; a slow one reads a little past the end of the spline."""
        return CubicSpline(times, output)(times / (1 + self.skew))
