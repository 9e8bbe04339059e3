"""What draws say of a quantity: how probable it is that it exists, and where it then lies."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import ndtri

from .._show import shown

_BEND = 0.1
"""Share of an interval by which delta method and draws may differ."""

_BY_CHANCE = 3.0
"""Standard errors of an end of the interval, by the count of draws, up to which the two differ by chance."""

_SEARCH_ROUNDING = 1e-6
"""Share of the value up to which the two differ by the tolerance of a search."""

_TAIL_STEP = 1e-3
"""Share of a tail by which its quantile is moved for its slope."""

_DRAWS_BEYOND = 2
"""Draws that an interval must leave out at least, one at either end: else they do not show its ends."""


@shown
class CredibleSet(NamedTuple):
    """Where a quantity lies that a model may not have, such as a fold: numbers, and the answer "none".

    Attributes:
        probability: that it exists: the share of the draws that give a number.
        probability_error: of this share, by the count of draws; never less than what one draw makes.
        standard_error: by the delta method; where `curved`, standard deviation of the draws that have it.
        interval: lower and upper end, first axis. Where "none" is improbable, so that the interval alone can
            hold the truth with the confidence asked for, its share of the draws times their probability is
            that confidence. Elsewhere "none" belongs to the set, and the interval is that of the draws that
            have the quantity. So the interval jumps where the probability passes the confidence: just above,
            it holds almost all of these draws; below, the confidence of them.
        curved: whether an end by the delta method differs from that by draws by more than a tenth of the
            interval, and by more than the count of draws explains; its ends are then quantiles of the draws.
    """

    probability: Float[np.ndarray, "..."]
    probability_error: Float[np.ndarray, "..."]
    standard_error: Float[np.ndarray, "..."]
    interval: Float[np.ndarray, "2 ..."]
    curved: Bool[np.ndarray, "..."]


def credible_set(
    value: Float[np.ndarray, "..."],
    error: Float[np.ndarray, "..."],
    drawn: Float[np.ndarray, "draw ..."],
    confidence: float,
    coverage_factor: Callable[[np.ndarray], np.ndarray] = lambda tail: -ndtri(tail),
) -> CredibleSet:
    """Give the set of numbers, and perhaps "none", that holds a quantity.

    Args:
        value: at the fitted coefficients; NaN where it does not exist there.
        error: by the delta method; NaN where that must not be taken.
        drawn: the quantity at coefficients drawn from their distribution; NaN where it does not exist.
        confidence: chance that the set is meant to hold the truth.
        coverage_factor: standard errors between the value and an end, by the chance beyond it; those of a
            normal law unless given.

    Returns:
        The set. Ends are NaN where too few draws have the quantity to tell them.

    Source: Box & Tiao 1973, Bayesian Inference in Statistical Analysis, sec. 2.8 (regions of given content);
        David & Nagaraja 2003, Order Statistics, sec. 10.2 (error of a quantile).
    """
    count, held = len(drawn), np.sum(np.isfinite(drawn), axis=0)
    share, share_error = existence(drawn)
    # "None" is left out of the set where the numbers alone can reach the confidence.
    alone = share > confidence
    content = np.where(alone, confidence / np.where(alone, share, 1.0), confidence)
    wanted = np.asarray(0.5 * (1.0 - content))
    # Further out than the outermost draw nothing can be compared.
    tail = np.asarray(np.maximum(wanted, 0.5 / count))
    spread = coverage_factor(tail) * error
    ends = _quantiles(drawn, tail)
    # How far the ends move with their share tells the error of a quantile of so many draws.
    beside = coverage_factor(tail * (1.0 - _TAIL_STEP)) - coverage_factor(tail * (1.0 + _TAIL_STEP))
    chance = np.sqrt((1.0 - tail) / tail / np.maximum(held, 1)) * beside / (2.0 * _TAIL_STEP) * error
    with np.errstate(invalid="ignore"):
        allowed = np.maximum(
            np.maximum(_BEND * 2.0 * spread, _BY_CHANCE * chance), _SEARCH_ROUNDING * np.abs(value)
        )
        curved = ~(np.max(np.abs(ends - np.stack([value - spread, value + spread])), axis=0) <= allowed)
    ends = np.where(held * (1.0 - confidence) >= _DRAWS_BEYOND, ends, np.nan)
    # A quantity that is least at the fit has all its draws on one side.
    inside = np.where(np.isnan(value), ends, value)
    ends = np.stack([np.minimum(ends[0], inside[0]), np.maximum(ends[1], inside[1])])
    # Where "none" may be all that is left out, the tail of the numbers is not known more exactly than that.
    reach = coverage_factor(np.where(share < 1.0, tail, wanted)) * error
    straight = np.stack([value - reach, value + reach])
    return CredibleSet(
        share,
        share_error,
        np.where(curved & np.isfinite(ends).all(axis=0), _spread(drawn), error),
        np.where(curved, ends, straight),
        np.asarray(curved),
    )


def existence(
    drawn: Float[np.ndarray, "draw ..."],
) -> tuple[Float[np.ndarray, "..."], Float[np.ndarray, "..."]]:
    """Give the share of draws that have a quantity, and the standard error of it.

    Args:
        drawn: the quantity; NaN where it does not exist.

    Returns:
        Both. The error is never less than what one draw makes.
    """
    share = np.asarray(np.mean(np.isfinite(drawn), axis=0))
    return share, np.asarray(np.sqrt(np.maximum(share * (1.0 - share), 1.0 / len(drawn)) / len(drawn)))


def _quantiles(
    drawn: Float[np.ndarray, "draw ..."], tail: Float[np.ndarray, "..."]
) -> Float[np.ndarray, "2 ..."]:
    """Give the two draws that leave a tail out at either end, of those that are numbers; NaN of none."""
    held = np.sum(np.isfinite(drawn), axis=0)
    ordered = np.sort(np.where(np.isfinite(drawn), drawn, np.nan), axis=0)  # NaN last
    reach = np.floor(tail * (held - 1)).astype(int)
    ends = [np.take_along_axis(ordered, np.maximum(at, 0)[None], 0)[0] for at in (reach, held - 1 - reach)]
    return np.stack(ends)


def _spread(drawn: Float[np.ndarray, "draw ..."]) -> Float[np.ndarray, "..."]:
    """Give the standard deviation of the draws that are numbers."""
    there = np.isfinite(drawn)
    held = np.maximum(np.sum(there, axis=0), 1)
    known = np.where(there, drawn, 0.0)
    away = np.where(there, known - np.sum(known, axis=0) / held, 0.0)
    return np.asarray(np.sqrt(np.sum(away**2, axis=0) / held))
