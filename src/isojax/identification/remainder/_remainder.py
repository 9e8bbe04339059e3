"""Description of what a fitted model leaves unexplained; it names no effect."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ..._progress import silent
from ..._results import is_successful
from ..._show import Row, shown
from .._rules import Rules
from ..diagnosis import is_good, leaves_noise, refit_from
from ..fitting import (
    DEFAULT_SOLVER,
    Estimate,
    Fit,
    Fitted,
    Search,
    as_fit,
    chi2_per_dof_of_all,
    search_of,
    thinned,
)
from ..traces import MatchingPursuit, matching_pursuit, no_laws, trace_free_laws
from ._dwell_remainder import DwellRemainder, dwell_remainders
from ._force_residual import ForceResidual, force_residuals

_SURFACE_CELLS = 20
"""Cells of the force map along each axis."""

_FEWEST_CELL_SAMPLES = 4
"""Fewest samples of a cell of the force map; a cell with fewer stays empty."""


@shown
class ForceMap(NamedTuple):
    """Mean force residual over the plane of displacement and velocity.

    Attributes:
        displacement: edges of the cells [m].
        velocity: edges [m/s].
        force: mean of the samples in each cell [N]; NaN where there are few.
    """

    displacement: Float[np.ndarray, " edge"]
    velocity: Float[np.ndarray, " edge"]
    force: Float[np.ndarray, "cell cell"]


@shown
class Remainder(NamedTuple):
    """What a fitted model leaves unexplained.

    Attributes:
        pursuit: force laws outside the catalogue that would explain it; none is tried where more than the
            noise is left but nothing of it comes back with the drive.
        dwells: force residual of each dwell; empty without dwells.
        force_map: mean force residual over displacement and velocity.
    """

    pursuit: MatchingPursuit
    dwells: tuple[DwellRemainder, ...]
    force_map: ForceMap

    def _headline(self) -> str:
        return self.pursuit._headline()

    def _rows(self) -> list[str | Row]:
        return [*self.pursuit._rows(), "dwells", "force_map"]


def explain_remainder(
    fit: Fit | Fitted,
    *,
    refit: bool = True,
    solver: Any = DEFAULT_SOLVER,
    progress: Callable[[str], None] = silent,
    rules: Rules = Rules(),
) -> Remainder:
    """Describe what a fitted model leaves of its records, where no known effect explains it.

    It names no effect and extends no model.

    Args:
        fit: the fit.
        refit: whether to refit with the selected laws, which checks their linear step.
        solver: an optimistix least-squares solver for the refit.
        progress: called with one line per step.
        rules: which laws stand out of the noise.

    Returns:
        The description.

    Raises:
        ValueError: if the fit failed, so that its residual means nothing.

    Example:
        With the fit of `fit`'s example:

        >>> remainder = ij.explain_remainder(fitted, refit=False)
        >>> len(remainder.dwells)
        54
    """
    fit = as_fit(fit)
    if not (is_successful(fit.result) and fit.estimate.point.is_finite):
        raise ValueError(f"Argument `fit` must have succeeded, but its result is {fit.result}.")
    search = search_of(fit.campaign, rules, solver, progress)
    whole = fit.estimate
    thin, coarser = thinned(whole, search)
    # Of noise that is not as it was measured no law's significance is known.
    noise_alone = leaves_noise(fit, rules) and not is_good(fit, rules)
    found = no_laws(thin) if noise_alone else matching_pursuit(trace_free_laws(thin, coarser), rules)
    refitted = _refitted_goodness(thin, found, coarser) if refit and found.laws else float("nan")
    pursuit = found._replace(
        chi2_per_dof=chi2_per_dof_of_all(found.chi2_per_dof, thin, whole),
        linear=chi2_per_dof_of_all(found.linear, thin, whole),
        refitted=chi2_per_dof_of_all(refitted, thin, whole),
    )
    progress("force residual")
    residuals = force_residuals(fit)
    return Remainder(pursuit, dwell_remainders(fit, residuals), _force_map(residuals))


def _refitted_goodness(fitted: Estimate, pursuit: MatchingPursuit, search: Search) -> float:
    """Give chi2/dof of a refit with the laws, started from the linear step of the coefficients."""
    search.progress("refit with " + ", ".join(law.formula for law in pursuit.laws))
    found = refit_from(fitted, pursuit.model, search._replace(progress=silent))
    return found.chi2 / found.dof if is_successful(found.result) and np.isfinite(found.chi2) else float("nan")


def _force_map(residuals: tuple[ForceResidual, ...]) -> ForceMap:
    """Average the force residual of the fitted records over cells of displacement and velocity."""
    used = [one for one in residuals if one.record.role == "fit"]
    x, v, force = (
        np.concatenate([getattr(one, name)[one.trusted] for one in used])
        for name in ("displacement", "velocity", "force")
    )
    edges = [np.linspace(-1.0, 1.0, _SURFACE_CELLS + 1) * float(np.max(np.abs(values))) for values in (x, v)]
    count = np.histogram2d(x, v, edges)[0]
    total = np.histogram2d(x, v, edges, weights=force)[0]
    mean = np.where(count >= _FEWEST_CELL_SAMPLES, total / np.maximum(count, 1.0), np.nan)
    return ForceMap(edges[0], edges[1], mean)
