"""Two air chambers joined by a line."""

from dataclasses import dataclass
from typing import ClassVar, no_type_check

import numpy as np

from ._law import Law, Switch


@no_type_check
def _difference(x, v, z):
    return z[0]


@dataclass(frozen=True)
class DualChamber(Law):
    """What a second chamber adds to an air spring whose stiffness with the line wide open is declared apart.

    Mass balance of both chambers at small changes of pressure, kappa P0 A^2 / V1 = k_lo + K:
    d' = (k_lo + K) v / A - (kappa P0 / V1) (1 + V1 / V2) Q, with d the difference of the pressures and the
    line d = R Q + S |Q| Q; f = A d V2 / (V1 + V2).

    Args:
        area: A, m^2.
        loaded: V1, m^3.
        second: V2, m^3.
        resistance: R, Pa s/m^3.
        orifice: S, Pa s^2/m^6; 0 for a laminar line.
        pressure: P0, absolute, Pa.
        exponent: kappa.
    """

    name: ClassVar[str] = "dual_chamber"
    inner: ClassVar[int] = 1
    area: float
    loaded: float
    second: float
    resistance: float
    orifice: float = 0.0
    pressure: float = 5e5
    exponent: float = 1.4

    @property
    def low_stiffness(self) -> float:
        """Stiffness of the gas with the line wide open, N/m."""
        return self.exponent * self.pressure * self.area**2 / (self.loaded + self.second)

    @property
    def switches(self) -> tuple[Switch, ...]:
        """The turning of the flow."""
        return (_difference,)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`. The state is the difference of the pressures in units of P0."""
        return self.area * self.pressure * z[0] * self.second / (self.loaded + self.second)

    @no_type_check
    def rate(self, t, x, v, z, s):
        """Rate of the difference of the pressures over P0, 1/s."""
        difference = s[0] * self.pressure * z[0]
        if self.orifice == 0:
            flow = difference / self.resistance
        else:
            # Past the turning of the flow the law of this side has a branch point; a trial step may go there.
            square = np.maximum(self.resistance**2 + 4 * self.orifice * difference, 0.0)
            flow = (np.sqrt(square) - self.resistance) / (2 * self.orifice)
        into = self.area * v / self.loaded
        return (self.exponent * (into - s[0] * flow * (1 / self.loaded + 1 / self.second)),)
