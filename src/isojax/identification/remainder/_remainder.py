"""What is left when no known effect explains the records: a description, never a finding."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ..._results import is_successful
from .._rules import Rules
from ..fitting import DEFAULT_SOLVER, Fit, search_of, silent
from ._ceiling import Ceiling, find_ceilings
from ._dwell_remainder import PARTS, DwellRemainder, share_parts, split_dwells
from ._exponents import Exponents, find_exponents
from ._force_residual import ForceResidual, force_residuals
from ._matching_pursuit import Pursuit, pursue_laws

_CELLS = 20
"""Cells of the force map along each axis."""

_FEWEST_SAMPLES = 4
"""Samples without which a cell of the force map stays empty."""


class ForceMap(NamedTuple):
    """Mean latent force over the plane of displacement and velocity.

    Attributes:
        displacement: edges of the cells [m].
        velocity: edges [m/s].
        force: mean of the samples in each cell [N]; NaN where there are few.
    """

    displacement: Float[np.ndarray, " edge"]
    velocity: Float[np.ndarray, " edge"]
    force: Float[np.ndarray, "cell cell"]


class Remainder(NamedTuple):
    """What a fitted model leaves, described.

    Attributes:
        pursuit: force laws, of no catalogue, that would make it up.
        dwells: what is left of each dwell; empty without dwells.
        parts: share of each harmonic in the power of the latent force beyond the noise, over all dwells;
            empty where nothing stands out.
        exponents: how it grows with amplitude and frequency; None where that cannot be told.
        static: how much any law of displacement and velocity alone could explain.
        black_box: how much any law with memories could.
        force_map: mean latent force over displacement and velocity.
    """

    pursuit: Pursuit
    dwells: tuple[DwellRemainder, ...]
    parts: dict[str, float]
    exponents: Exponents | None
    static: Ceiling
    black_box: Ceiling
    force_map: ForceMap


def explain_remainder(
    fit: Fit,
    *,
    refit: bool = True,
    solver: Any = DEFAULT_SOLVER,
    progress: Callable[[str], None] = silent,
    rules: Rules = Rules(),
) -> Remainder:
    """Describe what a fitted model leaves of its records, where no known effect explains it.

    Nothing of it is a finding: no effect is named and no model extended.

    Args:
        fit: the fit.
        refit: whether to fit the pursued laws, to say what their linear step is worth.
        solver: an optimistix least-squares solver for that.
        progress: receives a line a step.
        rules: which laws stand out of the noise.

    Returns:
        The description.

    Raises:
        ValueError: if the fit failed, so that what it leaves means nothing.
    """
    if not (is_successful(fit.result) and fit.estimate.point.is_finite):
        raise ValueError(f"Argument `fit` must have succeeded, but its result is {fit.result}.")
    search = search_of(fit.campaign, rules, solver, progress)
    pursuit = pursue_laws(fit.estimate, search, refit=refit)
    progress("the force that the balance lacks")
    latent = force_residuals(fit)
    dwells = split_dwells(fit, latent)
    parts = share_parts(dwells)
    # What is not locked to the drive leaks into harmonics and is none.
    locked = parts.get(PARTS[-1], 0.0) < 0.5
    static, black_box = find_ceilings(latent, search.scales)
    return Remainder(
        pursuit,
        dwells,
        parts,
        find_exponents(dwells) if locked else None,
        static,
        black_box,
        _force_map(latent),
    )


def _force_map(latent: tuple[ForceResidual, ...]) -> ForceMap:
    """Average the latent force of the fitted records over cells of displacement and velocity."""
    used = [one for one in latent if one.record.role == "fit"]
    x, v, force = (
        np.concatenate([getattr(one, name)[one.trusted] for one in used])
        for name in ("displacement", "velocity", "force")
    )
    edges = [np.linspace(-1.0, 1.0, _CELLS + 1) * float(np.max(np.abs(values))) for values in (x, v)]
    count = np.histogram2d(x, v, edges)[0]
    total = np.histogram2d(x, v, edges, weights=force)[0]
    mean = np.where(count >= _FEWEST_SAMPLES, total / np.maximum(count, 1.0), np.nan)
    return ForceMap(edges[0], edges[1], mean)
