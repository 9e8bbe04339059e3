"""Mass that moves along."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Lanes, Scalar
from ._element import AbstractElement, Group, LookAlike, Scales


class AddedMass(AbstractElement):
    """Mass that moves along and was not weighed.

    `dm x''` [N].

    Attributes:
        mass: dm [kg].

    Source: Newton's second law; in the linear range it cannot be distinguished from a gain error of
    the force or of the accelerometer.
    """

    name: ClassVar[str] = "added_mass"
    words: ClassVar[str] = "additional moving mass"
    strength: ClassVar[str] = "mass"
    signed: ClassVar[bool] = True
    group: ClassVar[Group] = "Relaxation and further masses"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("input_gain", "sensor_gain"),
            "weigh a known extra mass onto the isolator and repeat one level: a mass error stays in "
            "kilograms, a gain error stays in per cent",
        ),
    )

    mass: Scalar = parameter(symbol="dm", unit="kg")

    @classmethod
    def guess(cls, scales: Scales) -> "AddedMass":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.mass

    def inertia(self) -> Lanes | float:
        return self.mass
