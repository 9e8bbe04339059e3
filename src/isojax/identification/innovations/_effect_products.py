"""What absent effects would add to the innovations."""

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._parameters import element_names, list_parameters
from ...elements import AbstractElement
from ...models import Isolator
from ..jacobian import (
    SCORE_PIECES,
    STIFFNESS_SCALE_UNIT,
    Followed,
    Unknowns,
    has_stiffness_scale,
    internal_starts,
    score_information,
    with_zero,
)
from ._error_fit import ErrorFit


class EffectProducts(NamedTuple):
    """Products of columns, over the standard deviations of the innovations.

    The columns are the fitted coefficients, the absent effects, and the innovations.

    Attributes:
        whole: A^T A.
        pieces: A^T times the innovations of each piece of each record.
    """

    whole: Float[np.ndarray, "column column"]
    pieces: Float[np.ndarray, "column piece"]


def effect_products(
    fit: ErrorFit, absent: Sequence[AbstractElement], units: Float[np.ndarray, " effect"]
) -> EffectProducts:
    """Give the products of the innovations and of what a unit of each coefficient adds to the reading.

    Args:
        fit: the model beside which the effects are absent.
        absent: effects at zero strength.
        units: size of one unit of each strength.

    Returns:
        The products.
    """
    tables, own_zeros = fit.filter.tables, fit.filter.zeros
    fitted, zero = (fit.model, None) if own_zeros is None else with_zero(fit.model)
    whole = Isolator(fitted.mass, (*fitted.elements, *absent), fitted.excitation)
    carried = len(fitted.elements)
    listed, prepared = list_parameters(whole), tables.prepared(whole, carried)
    place_of = {entry.name: place for place, entry in enumerate(listed)}
    names = element_names(whole)[carried:]
    strengths = [place_of[f"{name}.{one.strength}"] for name, one in zip(names, absent, strict=True)]
    # Products of columns of the same size keep their digits.
    own = 1.0 / np.sqrt(np.maximum(np.diag(fit.information), 1e-300))
    places = [*fit.places, *strengths]
    directions = np.zeros((len(listed), len(places) + (zero is not None)))
    directions[places, range(len(places))] = [*own, *units]
    lanes, states = prepared.record.size, 2 + whole.internal_states
    starts = np.zeros((states, lanes))
    starts[2:] = internal_starts(whole, tables.records, prepared, carried)[0]
    factors = np.ones(lanes)
    factors[: fit.filter.count] = fit.filter.stiffness
    unknown = []  # of each record: its column, and its deviation and prior variance in units of that
    if zero is not None and own_zeros is not None:
        zeros, variance = own_zeros
        directions[zero, -1] = unit = float(np.sqrt(variance.max()))
        unknown.append((len(places), zeros / unit, variance / unit**2))
    if fit.filter.scatter > 0.0:
        variance = np.full(fit.filter.count, (fit.filter.scatter / STIFFNESS_SCALE_UNIT) ** 2)
        deviation = (fit.filter.stiffness - 1.0) / STIFFNESS_SCALE_UNIT
        unknown.append((directions.shape[1], deviation, variance))
    unknowns = Unknowns(whole, directions, factors, starts, np.ones((states, lanes)))
    followed = [
        Followed(
            trace.states[:-1],
            trace.gains,
            fit.sizes.correlation,
            jnp.nan_to_num(trace.error),
            jnp.where(jnp.isfinite(trace.deviation), 1.0 / trace.deviation, 0.0),
            _pieces(trace.deviation),
        )
        for trace in fit.way.traces
    ]
    products = score_information(unknowns, carried, prepared, followed)
    columns, last = directions.shape[1], products.shape[1] - 1
    assert last == columns + int(has_stiffness_scale(whole)) + 2 + fitted.internal_states
    for column, deviation, variance in unknown:
        row, used = products[:, column].copy(), slice(fit.filter.count)
        pull = deviation / variance
        row[used, last] -= pull
        row[used, last + 1 :] -= pull[:, None] / (products.shape[2] - last - 1)
        known = row[:, column].copy()
        known[used] += 1.0 / variance
        known = np.where(known > 0.0, known, np.inf)  # of a lane without a record
        products = products - products[:, :, column, None] * row[:, None] / known[:, None, None]
    # Between coefficients and residual stand the stiffness scale and the initial states of a simulation.
    keep = np.r_[0 : len(places), last]
    unit = np.r_[1.0 / own, np.ones(len(absent)), 1.0]
    pieces = np.moveaxis(products[:, keep, last + 1 :], 0, 1).reshape(keep.size, -1)
    whole = products[:, keep[:, None], keep].sum(axis=0)
    return EffectProducts(whole * np.outer(unit, unit), pieces * unit[:, None])


def _pieces(deviation: Float[Array, "time lanes"]) -> Int[Array, "time lanes"]:
    """Cut the samples of each lane that count into pieces of equal length."""
    counted = jnp.cumsum(jnp.isfinite(deviation), axis=0)
    return jnp.minimum(SCORE_PIECES * counted // jnp.maximum(counted[-1:], 1), SCORE_PIECES - 1)
