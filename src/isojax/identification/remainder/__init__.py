"""What a fit leaves unexplained, described but not named.

In comes a fit; out comes a `Remainder`, or the force laws that would do in the place of a finding
(`_alternative_laws`). Read `_remainder` first. `_force_residual` gives the force missing from the balance,
sample by sample, and `_dwell_remainder` its harmonics in each dwell.
"""

from ._alternative_laws import AlternativeLaw as AlternativeLaw
from ._alternative_laws import Alternatives as Alternatives
from ._alternative_laws import find_alternatives as find_alternatives
from ._dwell_remainder import DwellRemainder as DwellRemainder
from ._remainder import ForceMap as ForceMap
from ._remainder import Remainder as Remainder
from ._remainder import explain_remainder as explain_remainder
