"""The simulated rig: a mass, the laws of its force balance, and the effects of its instruments."""

from dataclasses import dataclass, replace

import numpy as np

from ._dampers import AbsQuadraticDamping, CubicDamping, LinearDamping
from ._instruments import Instrument
from ._law import Law, Stretch
from ._springs import AbsQuadraticStiffness, CubicStiffness, LinearStiffness

BASE_NAMES = (
    "linear_stiffness",
    "abs_quadratic_stiffness",
    "cubic_stiffness",
    "linear_damping",
    "abs_quadratic_damping",
    "cubic_damping",
)
"""Catalogue names of the six laws that every campaign declares, in the order of `base` in truth.json."""


def base_laws(k1: float, k2: float, k3: float, c1: float, c2: float, c3: float) -> tuple[Law, ...]:
    """The six laws k1 x + k2 |x| x + k3 x^3 and c1 v + c2 |v| v + c3 v^3, coefficients in SI units."""
    return (
        LinearStiffness(k1),
        AbsQuadraticStiffness(k2),
        CubicStiffness(k3),
        LinearDamping(c1),
        AbsQuadraticDamping(c2),
        CubicDamping(c3),
    )


@dataclass(frozen=True)
class Plant:
    """m x'' + sum of forces = F(t), seen through instruments.

    Args:
        laws: the forces that resist the motion.
        mass: declared moving mass, kg.
        instruments: effects between the plant and the file, in the order in which the signal meets them.

    Raises:
        ValueError: if the mass with all that moves along is not positive.
    """

    laws: tuple[Law, ...]
    mass: float = 800.0
    instruments: tuple[Instrument, ...] = ()

    def __post_init__(self) -> None:
        if self.moving_mass <= 0:
            raise ValueError(
                f"Argument `mass` must leave a positive moving mass, but it is {self.moving_mass} kg."
            )

    @property
    def moving_mass(self) -> float:
        """Declared mass and all that moves along, kg."""
        return self.mass + sum(law.inertia for law in self.laws)

    @property
    def hidden(self) -> tuple[Law | Instrument, ...]:
        """What the base model does not declare."""
        return tuple(law for law in self.laws if law.name not in BASE_NAMES) + self.instruments

    @property
    def lag(self) -> float:
        """Time by which the acting force lags the recorded one, s."""
        return sum((instrument.lag for instrument in self.instruments), 0.0)

    def plus(self, *effects: Law | Instrument) -> "Plant":
        """The plant with further effects, laws and instruments in any order."""
        return replace(
            self,
            laws=self.laws + tuple(effect for effect in effects if isinstance(effect, Law)),
            instruments=self.instruments
            + tuple(effect for effect in effects if isinstance(effect, Instrument)),
        )

    def drifted(self, scale: float) -> "Plant":
        """The plant with its linear stiffness multiplied by `scale`."""
        return replace(self, laws=tuple(law.drifted(scale) for law in self.laws))

    def placed(self, stretch: Stretch, draw: np.random.Generator) -> "Plant":
        """The plant in one record of a test: what has a time or a chance of its own has it there."""
        return replace(
            self,
            laws=tuple(law.placed(stretch, draw) for law in self.laws),
            instruments=tuple(instrument.placed(stretch, draw) for instrument in self.instruments),
        )

    @property
    def base_coefficients(self) -> list[float]:
        """Coefficients of the six base laws, SI, in the order of truth.json; 0 where a law is absent."""
        given = {law.name: float(vars(law)["coefficient"]) for law in self.laws if law.name in BASE_NAMES}
        return [given.get(name, 0.0) for name in BASE_NAMES]
