"""The contract of an element: those of a force, of an instrument and of what follows a signal, together."""

from ._effect import Channels as Channels
from ._effect import Group as Group
from ._effect import LookAlike as LookAlike
from ._effect import Scales as Scales
from ._follower import AbstractFollower
from ._force import AbstractForce
from ._instrument import AbstractInstrument

CONTRACTS = (AbstractForce, AbstractInstrument, AbstractFollower)


class AbstractElement(AbstractForce, AbstractInstrument, AbstractFollower):
    """One physical effect. An element overrides methods of one contract; those of the others stay neutral.

    The isolator may therefore ask each element everything, and never its type.
    """
