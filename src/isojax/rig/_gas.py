"""Gas law: a closed volume under changing load."""

from dataclasses import dataclass
from typing import ClassVar, no_type_check

import numpy as np

from ._law import Law


@dataclass(frozen=True)
class PolytropicGas(Law):
    """Closed gas volume: p V^n stays constant, f = (p - P0) A.

    Args:
        preload: P0 A, absolute pressure times area at rest, N.
        length: volume over area at rest, m.
        exponent: n.
        side: +1 where positive displacement compresses the gas, -1 where negative displacement does.

    Raises:
        ValueError: if `side` is neither.
    """

    name: ClassVar[str] = "polytropic_gas"
    preload: float
    length: float
    exponent: float
    side: float = 1.0

    def __post_init__(self) -> None:
        if self.side not in (1.0, -1.0):
            raise ValueError(f"Argument `side` must be 1 or -1, but is {self.side}.")

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N, NaN where no volume is left; see `Law.force`."""
        compression = np.log1p(-self.side * x / self.length)
        return self.side * self.preload * np.expm1(-self.exponent * compression)
