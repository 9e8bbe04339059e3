"""The coefficients of a fitted model with their errors: what carries a covariance into any answer."""

from collections.abc import Callable
from typing import NamedTuple, Protocol, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float
from scipy.special import ndtri

from .._given_numbers import asked_numbers
from .._parameters import full_names, list_parameters, replace_parameters
from .._results import RESULTS, is_successful
from .._show import shown
from ._isolator import Isolator
from ._normal_mixture import NormalMixture

_NO_SHARE = 1e-12
"""Share of the largest eigenvalue of a correlation below which a direction is rounding."""

_ROUGHLY = 1e-6
"""By how much correlations may miss symmetry, and their eigenvalues zero, by rounding."""

_LIKE = 0.2
"""Share by which standard errors of a mixture may differ from those of its covariance: errors that are added
do so by squares, which for long tails is not exact."""

_DRAWN_AGAIN = 50
"""Times that draws outside the bounds of a coefficient are drawn again."""


@runtime_checkable
class Estimated(Protocol):
    """Whatever holds a fitted model with the covariance of its coefficients: a fit, or a saved one."""

    @property
    def model(self) -> Isolator:
        """The fitted isolator."""
        ...

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the fitted coefficients."""
        ...

    @property
    def covariance(self) -> Float[np.ndarray, "coefficient coefficient"]:
        """Of these [product of their units]."""
        ...

    @property
    def result(self) -> RESULTS:
        """How the search ended."""
        ...


@runtime_checkable
class EndsEstimated(Protocol):
    """Whatever ends with a fit as `.after`: an extension, a closed loop."""

    @property
    def after(self) -> Estimated | None:
        """The last fit."""
        ...


@shown
class CoefficientErrors(NamedTuple):
    """A fitted model, and independent steps of one standard error from it.

    Attributes:
        model: the fitted isolator.
        places: of the fitted coefficients in `list_parameters`.
        values: of these.
        root: of their covariance, which is `root @ root.T`.
        mixture: law of the steps where its tails are longer than normal ones; None where it is standard
            normal.
    """

    model: Isolator
    places: tuple[int, ...]
    values: Float[np.ndarray, " coefficient"]
    root: Float[np.ndarray, "coefficient step"]
    mixture: NormalMixture | None = None

    @property
    def steps(self) -> int:
        """How many independent steps there are."""
        return self.root.shape[1]

    def moved(self, steps: Float[Array, " step"]) -> Isolator:
        """Give the isolator some standard deviations away.

        Args:
            steps: so many along each independent direction.

        Returns:
            The isolator.
        """
        numbers = [entry.value for entry in list_parameters(self.model)]
        for place, number in zip(self.places, self.values + self.root @ steps, strict=True):
            numbers[place] = number
        return replace_parameters(self.model, numbers)

    def carry(
        self, quantity: Callable[[Isolator], Array]
    ) -> tuple[Float[Array, "..."], Float[Array, "... step"]]:
        """Give a quantity of the model, and its change by each independent step, to first order.

        The norm of the changes is the standard error.

        Args:
            quantity: function of an isolator, differentiable by `jax.jacfwd`.

        Returns:
            Both.

        Raises:
            ValueError: if the quantity is no function, gives no real numbers, or JAX cannot differentiate it.
        """

        def twice(steps: Array) -> tuple[Array, Array]:
            value = asked_numbers("quantity", quantity, self.moved(steps))
            return value, value

        change, value = jax.jacfwd(twice, has_aux=True)(jnp.zeros(self.steps))
        return value, change

    def inside(self, steps: Float[np.ndarray, "draw step"]) -> Bool[np.ndarray, " draw"]:
        """Say for which steps all coefficients keep to their bounds.

        Args:
            steps: in standard deviations.

        Returns:
            Whether they do.
        """
        specs = [list_parameters(self.model)[place].spec for place in self.places]
        lower, upper = (np.array([getattr(spec, end) for spec in specs]) for end in ("lower", "upper"))
        moved = self.values + steps @ self.root.T
        return np.all((moved >= lower) & (moved <= upper), axis=1)

    def coverage_factor(
        self, change: Float[np.ndarray, "... step"], tail: float | Float[np.ndarray, "..."]
    ) -> Float[np.ndarray, "..."]:
        """Give how many standard errors lie between a quantity and an end beyond which some chance is.

        Args:
            change: of the quantity by each independent step.
            tail: the chance beyond, on one side.

        Returns:
            The coverage factor, to first order; 1.96 for 0.025.
        """
        if self.mixture is None:
            return np.broadcast_to(-ndtri(tail), change.shape[:-1])
        return self.mixture.coverage_factor(change, tail)

    @property
    def even_numbers(self) -> int:
        """How many even numbers a draw takes: see `steps_of`."""
        return self.steps + (self.mixture is not None)

    def steps_of(self, even: Float[np.ndarray, "draw number"]) -> Float[np.ndarray, "draw step"]:
        """Give the steps that belong to even numbers.

        Args:
            even: between 0 and 1, one for each step; then one that chooses among the parts of a mixture.

        Returns:
            The steps.
        """
        normal = ndtri(even[:, : self.steps])
        return normal if self.mixture is None else self.mixture.draw(even[:, -1], normal)

    def draw(self, count: int, seed: int) -> Float[np.ndarray, "draw step"]:
        """Draw steps whose coefficients keep to their bounds.

        Args:
            count: how many.
            seed: of the draws.

        Returns:
            The steps.

        Raises:
            ValueError: if almost no draw keeps to the bounds.
        """
        generator = np.random.default_rng(seed)

        def drawn(count: int) -> Float[np.ndarray, "draw step"]:
            normal = generator.standard_normal((count, self.steps))
            if self.mixture is None:
                return normal
            # Each part has its share of the draws, and not about that.
            return self.mixture.draw((generator.permutation(count) + 0.5) / count, normal)

        steps = drawn(count)
        for _ in range(_DRAWN_AGAIN):
            outside = ~self.inside(steps)
            if not outside.any():
                return steps
            steps[outside] = drawn(int(np.count_nonzero(outside)))
        raise ValueError(
            "Argument `fit` must leave its coefficients room between their bounds, but almost no draw falls "
            "there."
        )


def coefficient_errors(fit: Estimated | EndsEstimated, model: Isolator | None = None) -> CoefficientErrors:
    """Give the fitted coefficients and the root of their covariance.

    Args:
        fit: a fit, a saved one, or what ends with one.
        model: that answers are asked of, if any: it must be the fitted one.

    Returns:
        Them.

    Raises:
        ValueError: if there is no fit or it failed, the data do not determine a coefficient, or `model` is
            another than the fitted one.
    """
    held = fit if isinstance(fit, Estimated) else getattr(fit, "after", None)
    if not isinstance(held, Estimated):
        raise ValueError(
            "Argument `fit` must be a fit, a saved one, or an extension or a closed loop, whose last fit is "
            f"taken, but is of type {type(fit).__name__}."
        )
    if not is_successful(held.result):
        raise ValueError(f"Argument `fit` must have succeeded, but it did not. {RESULTS[held.result]}")
    listed = list_parameters(held.model)
    if model is not None:
        asked = {entry.name: float(entry.value) for entry in list_parameters(model)}
        other = [entry.name for entry in listed if asked.get(entry.name) != float(entry.value)]
        if other or len(asked) != len(listed):
            raise ValueError(
                "Argument `model` must be that of argument `fit`, such as fit.model, but differs in "
                f"{', '.join(other) or 'its elements'}."
            )
    free = full_names(held.model, held.free, "fit.free")
    covariance = np.asarray(held.covariance, dtype=float)
    if covariance.shape != (len(free),) * 2:
        raise ValueError(
            f"Argument `fit` must have a covariance with a row and a column for each of its {len(free)} "
            f"free coefficients, but its shape is {covariance.shape}."
        )
    variances = np.diag(covariance)
    negative = [name for name, one in zip(free, variances, strict=True) if one < 0.0]
    if negative:
        raise ValueError(
            f"Argument `fit` must have variances of 0 or above, but not for {', '.join(negative)}."
        )
    size = np.sqrt(variances)
    lost = [name for name, one in zip(free, size, strict=True) if not np.isfinite(one)]
    if lost:
        raise ValueError(
            "Argument `fit` must determine each free coefficient, but its data do not determine "
            f"{', '.join(lost)}."
        )
    # Scaled before the roots are taken: stiffness in N/m and in N/m^3 differ by many orders.
    safe = np.where(size > 0.0, size, 1.0)
    correlation = covariance / np.outer(safe, safe)
    if (
        not np.all(np.isfinite(correlation))
        or np.max(np.abs(correlation - correlation.T), initial=0.0) > _ROUGHLY
    ):
        raise ValueError("Argument `fit` must have a finite, symmetric covariance, but its entries are not.")
    shares, vectors = np.linalg.eigh(correlation)
    if shares.size and shares[0] < -_ROUGHLY:
        raise ValueError(
            "Argument `fit` must have a covariance without negative eigenvalues, but as correlations it has "
            f"one of {shares[0]:.3g}."
        )
    kept = shares > _NO_SHARE * shares.max(initial=0.0)
    root = safe[:, None] * vectors[:, kept] * np.sqrt(shares[kept])
    law = getattr(held, "mixture", None)
    if law is not None:
        pairs = zip(free, law.standard_errors, size, strict=True)
        other = [name for name, own, given in pairs if abs(own - given) > _LIKE * given]
        if other:
            raise ValueError(
                "Argument `fit` must have a mixture that belongs to its covariance, or None, but they differ "
                f"in the error of {', '.join(other)}."
            )
    back = (vectors[:, kept] / np.sqrt(shares[kept])).T / safe
    names = [entry.name for entry in listed]
    values = np.array([float(held.model[name]) for name in free])
    places = tuple(names.index(name) for name in free)
    return CoefficientErrors(held.model, places, values, root, None if law is None else law.propagated(back))
