"""isojax.identification.remainder."""

from ._ceiling import Ceiling as Ceiling
from ._dwell_remainder import DwellRemainder as DwellRemainder
from ._exponents import Exponents as Exponents
from ._matching_pursuit import PursuedLaw as PursuedLaw
from ._matching_pursuit import Pursuit as Pursuit
from ._remainder import ForceMap as ForceMap
from ._remainder import Remainder as Remainder
from ._remainder import explain_remainder as explain_remainder
from ._remainder import loop_remainder as loop_remainder
