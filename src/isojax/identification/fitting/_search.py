"""What a search of coefficients needs beside the records and its start."""

from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import optimistix as optx

from ..._progress import silent
from ...elements import Scales
from ...records import Campaign
from .._rules import Rules
from ..guess import scales

DEFAULT_SOLVER = eqx.tree_at(
    lambda solver: solver.search,
    optx.LevenbergMarquardt(rtol=1e-9, atol=1e-9),
    # optimistix lowers the damping only after a step that attains 99 % of the predicted decrease. Along the
    # curved valley of coefficients that the records hardly separate none does, and the search would creep.
    optx.ClassicalTrustRegion(high_cutoff=0.75),
)
"""Levenberg-Marquardt whose damping falls after a step that attains 75 % of the predicted decrease of chi2.

Source: Nocedal & Wright 2006, *Numerical Optimization*, algorithm 4.1.
"""


MOST_EVALUATIONS = 100
"""Simulations with derivatives of a search at most: most need ten, a curved valley some eighty."""

CONVERGED = 1e-2
"""Decrease of chi2, per max(chi2/dof, 1), below which a search is over: a hundredth of a standard error
squared."""

ROUGH = 0.1
"""The same for refits that are only ranked, as a share of the difference that makes a tie."""


class Rival(NamedTuple):
    """The best other model, far behind which a search is given up.

    Attributes:
        chi2: what it reaches.
        tie: difference of chi2 up to which two models are indistinguishable. A search that is further behind
            is given up where its pace, or its linear steps, do not promise to catch up.
    """

    chi2: float
    tie: float


class Search(NamedTuple):
    """How coefficients are sought and judged: what all searches of a campaign share, and when each is over.

    Attributes:
        scales: typical magnitudes of the campaign.
        rules: numbers that decide verdicts.
        solver: an optimistix least-squares solver.
        progress: receives a line a step.
        max_steps: simulations with derivatives after which a search gives up.
        tolerance: decrease of chi2, per max(chi2/dof, 1), below which a search is over.
        rival: another model, far behind which a search is given up.
    """

    scales: Scales
    rules: Rules = Rules()
    solver: Any = DEFAULT_SOLVER
    progress: Callable[[str], None] = silent
    max_steps: int = MOST_EVALUATIONS
    tolerance: float = CONVERGED
    rival: Rival | None = None


def search_of(
    campaign: Campaign,
    rules: Rules,
    solver: Any,
    progress: Callable[[str], None],
    max_steps: int = MOST_EVALUATIONS,
) -> Search:
    """Give the search of a campaign, from the arguments of a public function.

    Args:
        campaign: the measurements.
        rules: numbers that decide verdicts.
        solver: an optimistix least-squares solver.
        progress: receives a line a step.
        max_steps: simulations with derivatives of one search.

    Returns:
        The search.
    """
    return Search(scales(campaign), rules, solver, progress, max_steps)
