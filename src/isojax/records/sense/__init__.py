"""Whether the records can be what is declared, before anything is fitted.

In: a `Campaign`. Out: what speaks against its declaration, with the likely mistake and the line to change.
Read `_suspicion.py` and `_find_suspicions.py` first, then `_lines.py` and `_newton_balance.py` (the balance
of forces, without a model), `_readings.py` and `_sizes.py` (mistakes undone), `_clipped_levels.py`,
`_stray_samples.py`.
"""

from ._find_suspicions import find_suspicions as find_suspicions
from ._find_suspicions import refuse_contradictions as refuse_contradictions
from ._suspicion import Cause as Cause
from ._suspicion import Suspicion as Suspicion
