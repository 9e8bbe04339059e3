"""What a fitted model lacks: absent effects scored, refitted, and named or rejected.

In: a `Fit`. Out: a `Verdict`, with a `Finding` where an effect is missing.
Read `_diagnose` (the door, and the verdict), then in the order in which it asks them `_score` (all absent
effects), `_candidate_refits` and `_refit` (the strongest, everything free), `_imitations`, `_admissibility`
and `_passivity` (what speaks against them), `_evidence`, `_transfer` and `_bounds`. `_findings` and
`_separation` hold the results.
"""

from ._diagnose import Diagnosis as Diagnosis
from ._diagnose import diagnose as diagnose
from ._diagnose import diagnose_with as diagnose_with
from ._diagnose import is_good as is_good
from ._diagnose import leaves_noise as leaves_noise
from ._findings import Candidate as Candidate
from ._findings import Extension as Extension
from ._findings import Finding as Finding
from ._findings import Verdict as Verdict
from ._findings import VerdictWord as VerdictWord
from ._findings import findings_in as findings_in
from ._imitations import find_superfluous as find_superfluous
from ._refit import bic as bic
from ._refit import least_difference as least_difference
from ._refit import refit_from as refit_from
from ._separation import AGAIN as AGAIN
from ._separation import DWELLS as DWELLS
from ._separation import Conditions as Conditions
from ._separation import Experiment as Experiment
from ._separation import Prospect as Prospect
from ._separation import Separation as Separation
from ._separation import Waveform as Waveform
from ._separation import rank_prospects as rank_prospects
