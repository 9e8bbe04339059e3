"""What `import isojax` offers: type checkers read it here, and `__init__.py` imports from it on first use."""

import typing

from . import elements as elements
from . import excitations as excitations
from . import identification as identification
from . import inference as inference
from . import models as models
from . import paper as paper
from . import plot as plot
from . import records as records
from . import reporting as reporting
from . import stability as stability
from ._compiling import compile_quickly as compile_quickly
from ._results import RESULTS as RESULTS
from ._results import is_successful as is_successful
from .excitations import Harmonic as Harmonic
from .identification import classical_guess as classical_guess
from .identification import diagnose as diagnose
from .identification import explain_remainder as explain_remainder
from .identification import extend as extend
from .identification import find_separating_experiment as find_separating_experiment
from .identification import fit as fit
from .identification import load_fit as load_fit
from .identification import read_campaign as read_campaign
from .identification import residual as residual
from .inference import uncertainty as uncertainty
from .models import Integrator as Integrator
from .models import Isolator as Isolator
from .models import load_model as load_model
from .models import save_model as save_model
from .models import simulate as simulate
from .reporting import close_loop as close_loop
from .stability import backbone_curve as backbone_curve
from .stability import bifurcation_diagram as bifurcation_diagram
from .stability import continue_branch as continue_branch
from .stability import find_periodic_orbit as find_periodic_orbit
from .stability import fold_curve as fold_curve
from .stability import frequency_response as frequency_response
from .stability import harmonic_balance as harmonic_balance
from .stability import sensitivity as sensitivity
from .stability import stability_map as stability_map
from .stability import transmissibility as transmissibility

__version__: str

def __getattr__(name: str) -> typing.Any: ...
