"""Linear spring."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class LinearStiffness(AbstractElement):
    """Linear spring.

    `k1 x` [N].

    Attributes:
        coefficient: k1 [N/m].

    Source: the paper, eq. (4).
    """

    name: ClassVar[str] = "linear_stiffness"
    words: ClassVar[str] = "linear spring"
    strength: ClassVar[str] = "coefficient"
    signed: ClassVar[bool] = False
    group: ClassVar[Group] = "Springs"
    proportional_to: ClassVar[str] = "displacement"

    coefficient: Scalar = parameter(symbol="k1", unit="N/m")

    @classmethod
    def guess(cls, scales: Scales) -> "LinearStiffness":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.displacement

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.coefficient * x
