"""Hum of the mains on the response channel."""

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from ._instruments import Instrument
from ._law import Stretch


@dataclass(frozen=True)
class MainsHum(Instrument):
    """The output channel shows the output plus amplitude cos(2 pi frequency t + phase).

    Nothing locks the mains to the start of a record: each has a phase of its own.

    Args:
        amplitude: in the SI unit of the output.
        frequency: Hz.
    """

    name: ClassVar[str] = "mains_hum"
    amplitude: float
    frequency: float = 50.0
    _phase: float = field(default=0.0, repr=False)

    def placed(self, stretch: Stretch, draw: np.random.Generator) -> "MainsHum":
        """The hum in one record, with a phase of its own."""
        return replace(self, _phase=float(draw.uniform(0, 2 * np.pi)))

    def recorded_output(
        self, times: Float[np.ndarray, " time"], output: Float[np.ndarray, " time"]
    ) -> Float[np.ndarray, " time"]:
        """The output plus the hum."""
        return output + self.amplitude * np.cos(2 * np.pi * self.frequency * times + self._phase)
