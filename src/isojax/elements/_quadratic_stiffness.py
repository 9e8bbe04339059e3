"""Even quadratic spring."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, LookAlike, Scales


class QuadraticStiffness(AbstractElement):
    """Even quadratic spring: the two directions of motion differ (static load off centre, asymmetry).

    `q x^2` [N].

    Attributes:
        coefficient: q [N/m^2].

    Source: Nayfeh & Mook 1979, Nonlinear Oscillations, sec. 2.3: a mean offset and a second harmonic.
    """

    name: ClassVar[str] = "quadratic_stiffness"
    words: ClassVar[str] = "even quadratic spring (asymmetry)"
    strength: ClassVar[str] = "coefficient"
    signed: ClassVar[bool] = True
    group: ClassVar[Group] = "Springs"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("input_offset", "sensor_offset"),
            "measure the mean displacement (a DC-capable sensor); a known static load separates them only "
            "where no cubic spring shifts along with it",
            among=True,
        ),
    )

    coefficient: Scalar = parameter(symbol="q", unit="N/m^2")

    @classmethod
    def guess(cls, scales: Scales) -> "QuadraticStiffness":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.displacement**2

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.coefficient * x * x
