"""What is left when no known effect explains the records: a description, never a finding.

In: a `Fit`. Out: a `Remainder`.
Read `_remainder` (the door), then `_matching_pursuit` with `_free_laws` (which force laws would make it
up), `_force_residual` and `_dwell_remainder` (the missing force, sample by sample and dwell by dwell),
`_exponents` and `_ceiling` (how it grows, and how much any law could explain).
"""

from ._ceiling import Ceiling as Ceiling
from ._dwell_remainder import DwellRemainder as DwellRemainder
from ._exponents import Exponents as Exponents
from ._matching_pursuit import PursuedLaw as PursuedLaw
from ._matching_pursuit import Pursuit as Pursuit
from ._remainder import ForceMap as ForceMap
from ._remainder import Remainder as Remainder
from ._remainder import explain_remainder as explain_remainder
