"""Onto the branch that leaves another: orbits of doubled period, and orbits that have lost their symmetry."""

import jax.numpy as jnp

from ..._implicit import frozen
from ..._results import is_successful
from ..._types import check_float64
from ...models import EndsEstimated, Estimated, coefficient_errors
from ..orbit import ShootingMethod, refuse_traced
from ._arc_length import Departure, Stride
from ._branch import Branch, SpecialPoint
from ._branch_bands import with_bands
from ._tracing import assemble, trace

_ASIDE = 0.25
"""Distance from the bifurcation at which the new branch is looked for, over the largest step."""


def switch_branch(
    branch: Branch,
    special_point: SpecialPoint,
    *,
    step: float | None = None,
    most: int = 1000,
    fit: Estimated | EndsEstimated | None = None,
) -> Branch:
    """Follow the branch that leaves at a period doubling or at a broken symmetry.

    It starts a quarter of a step from the point in its critical direction, closed over twice the period
    (doubling) or over the full period in place of half of one (broken symmetry). The direction's sign is no
    choice: the two sides are one doubled orbit a period later, or mirror images.

    Args:
        branch: the branch on which the point lies.
        special_point: of kind "period_doubling" or "symmetry_breaking".
        step: largest step; that of `branch` if omitted.
        most: points to give up after.
        fit: with whose errors the new branch and its special points are given bands; `branch.model` is its
            model. None for no band.

    Returns:
        The new branch, over the range of the old one.

    Raises:
        ValueError: if the point is of another kind, was not found, or lies on no branch of the batch,
            `step` or `most` is not positive, or `fit` failed, leaves a coefficient undetermined or is of
            another model.

    Source: Keller 1977, Applications of Bifurcation Theory, p. 359; Kuznetsov 2004, Elements of Applied
    Bifurcation Theory, sec. 10.2.
    """
    check_float64()
    refuse_traced(branch.model, special_point.value)
    errors = None if fit is None else coefficient_errors(fit, branch.model)
    step = branch.longest if step is None else step
    for name, value in (("step", step), ("most", most)):
        if not value > 0:
            raise ValueError(f"Argument `{name}` must be positive, but is {value}.")
    if special_point.kind not in ("period_doubling", "symmetry_breaking"):
        raise ValueError(
            "Argument `special_point` must be of kind period_doubling or symmetry_breaking, but is of kind "
            f"{special_point.kind}."
        )
    if not is_successful(special_point.result):
        raise ValueError("Argument `special_point` must be one that was found, but its numbers are NaN.")
    scales = jnp.atleast_2d(branch.scale)
    if special_point.branch >= scales.shape[0]:
        raise ValueError(
            f"Argument `special_point` must lie on one of {scales.shape[0]} branches, but is of branch "
            f"{special_point.branch}."
        )
    lane = slice(special_point.branch, special_point.branch + 1)
    scale = scales[lane]
    drives = (jnp.atleast_1d(one)[lane] for one in (branch.family.amplitude, branch.family.frequency))
    family = branch.family.driven(*drives)
    periods = special_point.periods * (2 if special_point.kind == "period_doubling" else 1)
    still, point = frozen((family, special_point))
    direction = point.direction / scale[0]
    tangent = jnp.concatenate([direction / jnp.linalg.norm(direction), jnp.zeros(1)])
    origin = jnp.concatenate([point.y0 / scale[0], still.shares(point.value[None])])
    departure = Departure((origin + _ASIDE * step * tangent)[None], tangent[None], tangent[None])
    method = ShootingMethod(branch.integrator, periods, False)
    followed = trace(still, method, scale, departure, Stride(step, most))
    found = assemble(family, method, scale, followed, batched=False, step=step, events=branch.events)
    return found if errors is None else with_bands(found, errors)
