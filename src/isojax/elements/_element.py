"""The contract of an element: those of a force, of an instrument and of what follows a signal, together."""

import abc

from .._show import declared_numbers, shown
from ._effect import Channels as Channels
from ._effect import Group as Group
from ._effect import LookAlike as LookAlike
from ._effect import Scales as Scales
from ._follower import AbstractFollower
from ._follower import AddedHarmonic as AddedHarmonic
from ._follower import Dependence as Dependence
from ._force import AbstractForce
from ._instrument import AbstractInstrument


@shown
class AbstractElement(AbstractForce, AbstractInstrument, AbstractFollower):
    """One physical effect. An element overrides methods of one contract; those of the others stay neutral.

    The isolator may therefore ask each element everything, and never its type.
    """

    @classmethod
    @abc.abstractmethod
    def guess(cls, scales: Scales) -> "AbstractElement":
        """Give the absent effect (zero strength) with sensible shape parameters.

        Args:
            scales: magnitudes of the record.

        Returns:
            The element at zero strength.
        """

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[AbstractElement, ...]":
        """Give the absent effect over a grid of the parameters that mean nothing at zero strength.

        Args:
            scales: magnitudes of the record.

        Returns:
            Elements at zero strength; one if there is nothing to vary.
        """
        return (cls.guess(scales),)

    @classmethod
    @abc.abstractmethod
    def typical_strength(cls, scales: Scales) -> float:
        """Give the strength at which the effect would be as large as the motion itself.

        Args:
            scales: magnitudes of the record.

        Returns:
            Strength [its SI unit], positive; the scale of columns and of bounds.
        """

    def twins(self) -> "tuple[AbstractElement, ...]":
        """Give this law as its exact look-alikes of other kinds, which no search need find.

        Returns:
            One element for each of the exact `look_alikes`, with the shape and strength that make it this
            law, but for a force of the effects beside which they are alike.
        """
        return ()

    @classmethod
    def twin_of(cls, other: "AbstractElement") -> "AbstractElement | None":
        """Give the law of an exact look-alike as one of this kind: the way back from `twins`.

        Args:
            other: an element of any kind.

        Returns:
            The element of this kind, with one of the shapes that do; None where there is none.
        """
        return None

    def _headline(self) -> str:
        return f"{self.words}: {declared_numbers(self)}"
