"""Value, standard error and interval of a quantity of a fitted model."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .._given_numbers import asked_numbers, given_chance, given_count
from .._progress import silent
from .._show import Row, shown
from .._types import check_float64
from ..models import (
    CoefficientErrors,
    CredibleSet,
    EndsEstimated,
    Estimated,
    Isolator,
    coefficient_errors,
    credible_set,
)
from ._evaluate import NOT_FINITE, evaluate
from ._named_quantity import NamedQuantity

_UNDECIDED_WITHIN = 2.0
"""Standard errors of a probability within which the confidence asked for counts as reached or missed by
chance."""


@shown
class UncertainQuantity(NamedTuple):
    """A quantity of a fitted model with its error.

    Attributes:
        value: at the fitted coefficients, in the quantity's own shape; NaN where it does not exist there.
        standard_error: by the delta method; of several fits, or where `curved`, and the interval is known,
            standard deviation of the draws that have the quantity.
        interval: lower and upper end, first axis; of several fits, or where `curved`, quantiles of the draws.
            Where `may_not_exist`, that of the values it has where it exists; elsewhere draws without it count
            as lying outside. So it jumps where `probability` passes `confidence`: just above, it holds almost
            all values that the draws have; just below, the confidence of them. NaN where too few draws have
            it.
        confidence: chance that the interval, or "none" where `may_not_exist`, is meant to hold the truth.
        curved: where the quantity bends so much within the error of the coefficients that an end of the
            interval by the delta method differs from that by draws by more than a tenth of its width, and by
            more than the count of draws explains; of several fits, where it does so of one of them.
        draws: the quantity at coefficients drawn from their distribution, draw first; NaN where it
            does not exist.
        failed: share of the draws that gave no finite number.
        reason: why most of them failed, or why the quantity failed at the fitted coefficients; "" where none
            did.
        weights: of the fits that the answer rests on, in their order.
        probability: that the quantity exists, by the share of the draws that have it.
        probability_error: standard error of that share, by the count of draws.
        names: of the numbers, in the order of the arrays, where the quantity gives a dict; else empty.
    """

    value: Float[np.ndarray, "..."]
    standard_error: Float[np.ndarray, "..."]
    interval: Float[np.ndarray, "2 ..."]
    confidence: float
    curved: np.ndarray
    draws: Float[np.ndarray, "draw ..."]
    failed: float
    reason: str
    weights: tuple[float, ...]
    probability: Float[np.ndarray, "..."]
    probability_error: Float[np.ndarray, "..."]
    names: tuple[str, ...] = ()

    @property
    def may_not_exist(self) -> Bool[np.ndarray, "..."]:
        """Where "none" is among the answers that the confidence asks for, beside the interval."""
        return np.asarray(self.probability <= self.confidence)

    def _headline(self) -> str:
        bent = (
            f", curved in {np.count_nonzero(self.curved)} of {self.curved.size}" if self.curved.any() else ""
        )
        lost = f", {self.failed:.2%} of the draws have no value" if self.failed else ""
        shares = ", ".join(f"{weight:.0%}" for weight in self.weights)
        several = f", of {len(self.weights)} fits weighed {shares}" if len(self.weights) > 1 else ""
        return f"{100.0 * self.confidence:g}% interval, {len(self.draws)} draws{several}{bent}{lost}"

    def _lines(self) -> list[str]:
        who = "Draws" if self.failed else "The fit"
        lines = [f"{who} without a value: {self.reason}"] if self.reason else []
        near = np.abs(self.probability - self.confidence) <= _UNDECIDED_WITHIN * self.probability_error
        if np.any(near & (self.probability < 1.0)):
            lines.append(
                f"Whether the probability reaches {100.0 * self.confidence:g}%, at which the interval jumps, "
                "takes more draws to say"
            )
        return lines

    def _rows(self) -> list[Row]:
        flat = [
            np.ravel(one)
            for one in (self.value, self.standard_error, *self.interval, self.curved, self.probability)
        ]
        return [
            Row(
                self.names[place] if self.names else f"[{place}]",
                # Where the draws are not symmetric a standard error would mislead beside their interval.
                f"{value:.6g}" + ("" if bent else f" ± {error:.2g}") if np.isfinite(value) else "none",
                self._in_words(low, high, share),
            )
            for place, (value, error, low, high, bent, share) in enumerate(zip(*flat, strict=True))
        ]

    def _in_words(self, low: float, high: float, probability: float) -> str:
        """Say where the quantity lies, and how probable it is where that is in doubt."""
        span = f"{low:.6g} to {high:.6g}"
        if probability == 1.0:
            return span
        chance = f"exists with probability {probability:.3g}"
        if probability > self.confidence:
            return f"{span}; {chance}"
        if not np.isfinite(low):
            return f"{chance}: too few draws for an interval"
        return f"{chance}; where it does, {100.0 * self.confidence:g}% lie in {span}"


def uncertainty(
    fit: Estimated | EndsEstimated | Sequence[Any],
    quantity: Callable[[Isolator], Any],
    *,
    confidence: float = 0.95,
    draws: int = 1000,
    seed: int = 0,
    progress: Callable[[str], None] = silent,
) -> UncertainQuantity:
    """Carry the error of a fit into a quantity of its model.

    The delta method takes exact derivatives and the covariance of the coefficients. Draws from their
    distribution, those outside the bounds of a coefficient drawn again, show where a first derivative is not
    enough; there their quantiles are the interval. That distribution is normal, but where two records or
    more tell a scatter of the stiffness it is a mixture over the scatters that they allow: the fewer they
    are, the longer its tails.

    A quantity may not exist, as a fold does not past its cusp: where it is NaN. The share of the draws that
    have it is then the probability that it exists, and the interval is stated beside it.

    Args:
        fit: a fit, a saved one, or what ends with one: an extension, a closed loop; or a list of fits to the
            same records, each of which is weighed by its evidence.
        quantity: function of an isolator that gives real numbers: one, an array, or a dict of single ones by
            their names, which the answer keeps. It must be differentiable by `jax.jacfwd`. Where `jax.vmap`
            cannot go through it, draws are taken one by one; `find_again` lets it go through folds and
            orbits. Where it is NaN or raises, at a draw or at the fitted coefficients, it does not exist.
        confidence: chance that the interval is to hold the truth.
        draws: how many; at least 100.
        seed: of the draws.
        progress: receives a line a chunk of draws.

    Returns:
        Value, standard error and interval; of several fits the value is that of the best.

    Raises:
        ValueError: if a fit failed, fits are not to the same records, the data do not determine a
            coefficient, the quantity is complex or finite nowhere near the fitted coefficients, or
            `confidence` or `draws` is out of range.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Seber & Wild 1989, Nonlinear Regression, sec. 5.1 (delta method); JCGM 101:2008 (draws); Hoeting
        et al. 1999, Statistical Science 14:382 (several models), Kass & Raftery 1995, J. Am. Stat. Assoc.
        90:773 (evidence by BIC).

    Example:
        With the fit of `fit`'s example, the amplitude of the motion at 100 N and 5 Hz:

        >>> def amplitude(model):
        ...     return ij.find_periodic_orbit(model, ij.Harmonic(100.0, 5.0)).amplitude
        >>> answer = ij.uncertainty(fitted, amplitude)
        >>> bool(answer.interval[0] < answer.value < answer.interval[1])
        True
    """
    check_float64()
    confidence = given_chance("confidence", confidence)
    draws, seed = given_count("draws", draws, least=100), given_count("seed", seed, least=0)
    # A named tuple, which a saved fit may be, is one fit.
    fits: list[Any] = list(fit) if isinstance(fit, list) or type(fit) is tuple else [fit]
    if not fits:
        raise ValueError("Argument `fit` must hold at least one fit, but the list is empty.")
    weights = _evidence(fits) if len(fits) > 1 else np.ones(1)
    counts = np.maximum(np.round(weights * draws), weights == weights.max()).astype(int)
    asked = NamedQuantity(quantity) if callable(quantity) else quantity
    parts = [
        _carried(coefficient_errors(fits[place]), asked, int(counts[place]), seed + int(place), progress)
        for place in np.argsort(-weights, kind="stable")
        if counts[place]
    ]
    value, error = parts[0].value, parts[0].error
    drawn = np.concatenate([part.draws for part in parts])
    finite = np.all(np.isfinite(drawn), axis=tuple(range(1, drawn.ndim)))
    if not np.isfinite(drawn).any():
        raise ValueError(
            "Argument `quantity` must give finite numbers near the fitted coefficients, but gave none."
        )
    # The delta method knows one law: several are not one normal distribution, whether or not a law bends.
    straight = error if len(fits) == 1 else np.full_like(error, np.nan)
    known = credible_set(value, straight, drawn, confidence, parts[0].coverage_factor)
    bent = [part.known(confidence).curved for part in parts]
    return UncertainQuantity(
        value,
        known.standard_error,
        known.interval,
        confidence,
        np.any(bent, axis=0),
        drawn,
        float(1.0 - finite.mean()),
        next((part.reason for part in parts if part.reason), "" if finite.all() else NOT_FINITE),
        tuple(weights.tolist()),
        known.probability,
        known.probability_error,
        asked.names if isinstance(asked, NamedQuantity) else (),
    )


class _Carried(NamedTuple):
    """A quantity of one fit.

    Attributes:
        value: at the fitted coefficients.
        error: its standard error by the delta method.
        draws: the quantity at drawn coefficients.
        reason: why it raised, if it did.
        coverage_factor: standard errors between the value and an end, by the chance beyond it.
    """

    value: Float[np.ndarray, "..."]
    error: Float[np.ndarray, "..."]
    draws: Float[np.ndarray, "draw ..."]
    reason: str
    coverage_factor: Callable[[np.ndarray], np.ndarray]

    def known(self, confidence: float) -> CredibleSet:
        """Give the set that holds the quantity, and perhaps "none"."""
        return credible_set(self.value, self.error, self.draws, confidence, self.coverage_factor)


def _carried(
    errors: CoefficientErrors,
    quantity: Callable[[Isolator], Any],
    draws: int,
    seed: int,
    progress: Callable[[str], None],
) -> _Carried:
    """Carry the error of one fit."""

    def at(steps: Float[Array, " step"]) -> Array:
        return asked_numbers("quantity", quantity, errors.moved(steps))

    missing, known = "", None
    try:
        known = errors.carry(quantity)
    except Exception as problem:
        missing = _why_missing(quantity, errors)
        if not missing:
            raise problem
    drawn, raised = evaluate(at, errors.draw(draws, seed), progress)
    if known is None:
        known = np.full(drawn.shape[1:], np.nan), np.full((*drawn.shape[1:], errors.steps), np.nan)
    value, change = (np.asarray(one, dtype=float) for one in known)
    error = np.asarray(np.linalg.norm(change, axis=-1))
    coverage_factor = partial(errors.coverage_factor, change)
    return _Carried(value, error, np.asarray(drawn, dtype=float), raised or missing, coverage_factor)


def _why_missing(quantity: Callable[[Isolator], Any], errors: CoefficientErrors) -> str:
    """Say why a quantity has no value at the fitted coefficients; "" if only JAX cannot go through it."""
    if not callable(quantity):
        return ""
    try:
        quantity(errors.moved(jnp.zeros(errors.steps)))
    except Exception as problem:  # what a fold is asked for where there is none may raise anything
        return f"{type(problem).__name__}: {problem}"
    return ""


def _check_same_records(fits: list[Any]) -> None:
    """Refuse fits whose records are known and differ; a saved fit holds none."""
    campaigns = [one.campaign for one in fits if getattr(one, "campaign", None) is not None]
    measured = [[(record.input, record.output) for record in campaign.fit_records] for campaign in campaigns]
    for place, other in enumerate(measured[1:], start=1):
        same = len(other) == len(measured[0]) and all(
            np.array_equal(one, its)
            for pair in zip(measured[0], other, strict=True)
            for one, its in zip(*pair, strict=True)
        )
        if not same:
            raise ValueError(
                "Argument `fit` must list fits to the same records, but those of campaign "
                f"{campaigns[place].title!r} differ from those of {campaigns[0].title!r}."
            )


def _evidence(fits: list[Any]) -> Float[np.ndarray, " fit"]:
    """Give the share of the evidence that each fit has, by BIC per max(chi2/dof, 1) of the best."""
    held = [one if isinstance(one, Estimated) else getattr(one, "after", None) for one in fits]
    stats = [getattr(one, "stats", None) for one in held]
    known = [(one.samples, one.bic, one.chi2 / one.dof) for one in stats if one is not None]
    if len(known) < len(fits) or len({samples for samples, _, _ in known}) > 1:
        raise ValueError(
            "Argument `fit` must list fits to the same records, but these count "
            f"{', '.join(str(samples) for samples, _, _ in known) or 'no'} samples in "
            f"{len(known)} of {len(fits)} fits."
        )
    _check_same_records(held)
    bic = np.array([one for _, one, _ in known])
    inflation = max(1.0, min(misfit for _, _, misfit in known))
    weight = np.exp(-0.5 * (bic - bic.min()) / inflation)
    return weight / weight.sum()
