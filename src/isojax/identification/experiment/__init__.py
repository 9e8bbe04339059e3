"""The next test: which experiment separates a finding from the effects that look like it.

In: an `Extension` (a model before and after a finding). Out: a `Separation`, the candidate tests with their
gain.
Read `_find_separation` (the door), then `_candidate_experiments` (what the test rig could do),
`_simulated_records` (what it would record) and `_known_load` (a static load as an element).
"""

from ._find_separation import find_separating_experiment as find_separating_experiment
from ._find_separation import with_separating_experiment as with_separating_experiment
