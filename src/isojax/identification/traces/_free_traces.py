"""The free force laws beside a fit: what each would leave in its records."""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from ...elements import AbstractElement, Scales
from ..fitting import Estimate, Search
from ._free_laws import AbstractFreeForce, free_laws
from ._projection import Projection, project

_AWAY = np.array([-1.0, -0.7, -0.4, 0.4, 0.7, 1.0])
"""Shares of the largest motion at which laws are compared: far from where their jumps are rounded."""

_SAME_LAW = 1e-3
"""Lack of correlation there of two laws that differ in their rounding alone."""


class FreeTraces(NamedTuple):
    """The free force laws beside a fit, at zero strength.

    Attributes:
        fitted: the fit.
        laws: the laws.
        units: size of one unit of the strength of each.
        projection: their traces in the records.
    """

    fitted: Estimate
    laws: tuple[AbstractFreeForce, ...]
    units: Float[np.ndarray, " law"]
    projection: Projection


def trace_free_laws(fitted: Estimate, search: Search) -> FreeTraces:
    """Give the traces of all free force laws beside a fit.

    A law that the model has already, with sharp jumps where the free one is rounded, leaves nothing but the
    rounding: it counts as unseen.

    Args:
        fitted: the estimate.
        search: how to search.

    Returns:
        The traces.
    """
    laws = free_laws(search.scales)
    search.progress(f"traces of {len(laws)} free force laws")
    units = np.array([1e-3 * law.typical_strength(search.scales) for law in laws])
    traces = project(fitted, laws, units)
    known = _forces([one for one in fitted.model.elements if one.splits], search.scales)
    already = [any(_is_same_law(force, other) for other in known) for force in _forces(laws, search.scales)]
    return FreeTraces(
        fitted, laws, units, traces._replace(visibility=np.where(already, 0.0, traces.visibility))
    )


def _forces(elements: Sequence[AbstractElement], scales: Scales) -> list[Float[np.ndarray, " point"] | None]:
    """Give the forces of a unit of strength away from rest, of rms 1; None of laws with internal states."""
    far, fast = (float(one) * _AWAY for one in (scales.displacement, scales.velocity))
    x, v = (np.ravel(one) for one in np.meshgrid(far, fast))

    def force(element: AbstractElement) -> Float[np.ndarray, " point"] | None:
        if element.internal_states:
            return None
        unit = eqx.tree_at(lambda one: getattr(one, one.strength), element, jnp.asarray(1.0))
        values = np.broadcast_to(np.asarray(unit.force(jnp.asarray(x), jnp.asarray(v), ())), x.shape)
        return values / max(float(np.sqrt(np.mean(values**2))), 1e-300)

    return [force(element) for element in elements]


def _is_same_law(
    force: Float[np.ndarray, " point"] | None, other: Float[np.ndarray, " point"] | None
) -> bool:
    """Say whether two forces are one law but for how their jumps are rounded."""
    if force is None or other is None:
        return False
    return bool(abs(np.mean(force * other)) > 1.0 - _SAME_LAW)
