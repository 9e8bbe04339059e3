"""The next test: which record shrinks the intervals, or separates a finding from its look-alikes.

In: a fit, or an `Extension` (a model before and after a finding). Out: a `NextTest` or a `Separation`, the
candidate tests with what each is expected to say.
Read the doors `_next_test` and `_find_separation`, then what both go through: `_test_outline` (what the
campaign did), `_record_candidates` and `_candidate_experiments` (what the test rig could do), `_trial_drive`,
`_simulated_records` (what it would record), `_trial_information` (what that says) and `_known_load` (a static
load as an element). `_proposals` holds the result.
"""

from ._find_separation import find_separating_experiment as find_separating_experiment
from ._find_separation import with_separating_experiment as with_separating_experiment
from ._next_test import next_test as next_test
from ._proposals import NextTest as NextTest
from ._proposals import Proposal as Proposal
