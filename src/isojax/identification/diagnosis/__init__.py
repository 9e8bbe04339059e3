"""isojax.identification.diagnose."""

from ._bounds import GOOD as GOOD
from ._diagnose import CLOSE_LIKENESS as CLOSE_LIKENESS
from ._diagnose import MOST_OF_IT as MOST_OF_IT
from ._diagnose import diagnose as diagnose
from ._diagnose import is_clean as is_clean
from ._diagnose import is_good as is_good
from ._evidence import CLOSE_BIC as CLOSE_BIC
from ._findings import Candidate as Candidate
from ._findings import Extension as Extension
from ._findings import Finding as Finding
from ._findings import Loop as Loop
from ._findings import Verdict as Verdict
from ._findings import VerdictWord as VerdictWord
from ._findings import findings_in as findings_in
from ._imitations import find_superfluous as find_superfluous
from ._projection import Projection as Projection
from ._projection import project as project
from ._refit import SMALLEST_GAIN as SMALLEST_GAIN
from ._refit import bic as bic
from ._refit import refit_from as refit_from
from ._separation import AGAIN as AGAIN
from ._separation import Experiment as Experiment
from ._separation import Prospect as Prospect
from ._separation import Separation as Separation
from ._separation import rank_prospects as rank_prospects
