"""Special points of a curve of bifurcations: as numbers with derivatives, and found again for a model."""

import dataclasses

import diffrax
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Float

from ..._implicit import frozen
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ...models import Isolator
from ..orbit import ShootingMethod, event_places, multipliers
from ._bifurcation_curves import CodimensionTwoPoint
from ._criticality import BifurcationKind
from ._extended_system import MOST_PLACES, MOVED_WITHIN, PointGuess, Polished, polish_jitted
from ._parameter_family import ParameterFamily

TESTS: dict[BifurcationKind, dict[str, float | None]] = {
    "fold": {"cusp": None, "resonance_1_1": 1.0},
    "period_doubling": {"generalised_doubling": None, "resonance_1_2": -1.0},
    "neimark_sacker": {
        "resonance_1_1": 1.0,
        "resonance_1_2": -1.0,
        "resonance_1_3": -0.5,
        "resonance_1_4": 0.0,
    },
}
"""Special points of each kind of curve, with the cosine of the critical pair's angle there; None where the
quadratic coefficient of a fold, or the cubic one of a doubling, vanishes."""


@quick_jit
def codimension_two_point(
    name: str,
    family: ParameterFamily,
    method: ShootingMethod,
    along: BifurcationKind,
    found: Polished,
    towards: Float[Array, " unknown"],
    rise: Float[Array, ""],
) -> CodimensionTwoPoint:
    """Give a special point from the solution of its curve's equations there.

    Args:
        name: which special point.
        family: isolators and drives over the window; their derivatives reach the point.
        method: how the orbit is closed.
        along: kind of the curve.
        found: the solution.
        towards: unit vector along the curve, of the scaled state and the shares.
        rise: change along it of the coefficient that vanishes there.

    Returns:
        The point. It moves with the model as the two conditions say, and not across the curve.
    """
    good = found.found & found.complete
    found = found._replace(system=found.system.at_special_point(TESTS[along][name])).moving(family)
    blank = jnp.where(good, 1.0, jnp.nan)
    amplitude, frequency = family.values(found.shares) * blank
    roots = multipliers(found.matrix * blank)
    return CodimensionTwoPoint(
        name,
        amplitude,
        frequency,
        found.state * blank,
        roots * roots if method.half else roots,
        RESULTS.where(good, RESULTS.promote(diffrax.RESULTS.successful), RESULTS.not_converged),
        along,
        method.periods,
        method.half,
        family,
        method.integrator,
        towards,
        found.scale,
        rise,
    )


def find_codimension_two_again(point: CodimensionTwoPoint, model: Isolator) -> CodimensionTwoPoint:
    """Find a special point of a curve of bifurcations for a model close by, without the curve.

    Args:
        point: the known point; no number of it is traced.
        model: the isolator, with the same elements; its numbers may be traced.

    Returns:
        The point for this model.
    """
    family, method = dataclasses.replace(point.family, model=model), point.method
    shares = family.shares(jnp.stack([point.amplitude, point.frequency]))
    cosine = TESTS[point.along][point.kind]
    if cosine is None:
        guess = PointGuess(point.y0, shares, (point.towards, point.scale), rise=point.rise)
    else:
        guess = PointGuess(point.y0, shares, cosine=jnp.asarray(cosine))
    places = event_places(model, method.turns)
    still, guess, reach = *frozen((family, guess)), jnp.asarray(MOVED_WITHIN)
    found = polish_jitted(still, method, point.along, guess, places, within=reach)
    while not isinstance(found.complete, Tracer) and not found.complete and places < MOST_PLACES:
        places *= 2
        found = polish_jitted(still, method, point.along, guess, places, within=reach)
    return codimension_two_point(point.kind, family, method, point.along, found, point.towards, point.rise)
