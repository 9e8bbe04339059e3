"""The coefficients of a design in coordinates from 0 to 1, and quantities with their derivatives by these."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float
from scipy.special import ndtri

from .._parameters import list_parameters, replace_parameters
from .._show import number
from ..models import CoefficientErrors, Isolator
from ._constraint import Constraint

_STEP = 1e-4
"""Step of the coordinates for the derivative of a standard error, itself made of exact derivatives."""


class NotFinite(Exception):
    """A quantity or its derivative is not finite, or not to be had, where a search asked for it."""

    def __init__(self, at: Float[np.ndarray, " coordinate"], words: str):
        """Keep the point, and what failed in words."""
        super().__init__(words)
        self.at = at


class Space(NamedTuple):
    """Coefficients that a design may choose.

    A coefficient whose bounds have one sign moves along its logarithm, any other evenly, so that one of 1 and
    one of 1e11 weigh alike.

    Attributes:
        model: the isolator.
        names: of the free coefficients.
        places: of these in `list_parameters`.
        lower: smallest values.
        upper: largest values.
        logarithmic: whether each moves along its logarithm.
    """

    model: Isolator
    names: tuple[str, ...]
    places: tuple[int, ...]
    lower: Float[np.ndarray, " coordinate"]
    upper: Float[np.ndarray, " coordinate"]
    logarithmic: Bool[np.ndarray, " coordinate"]

    def values(self, at: Any) -> Array:
        """Give the coefficients at a point."""
        logarithmic, safe = jnp.asarray(self.logarithmic), np.where(self.logarithmic, self.lower, 1.0)
        ratio = np.where(self.logarithmic, self.upper / safe, 1.0)
        evenly = self.lower + (self.upper - self.lower) * at
        return jnp.where(logarithmic, safe * ratio**at, evenly)

    def coordinates(self, values: Float[np.ndarray, " coordinate"]) -> Float[np.ndarray, " coordinate"]:
        """Give the point of given coefficients."""
        safe = np.where(self.logarithmic, values / self.lower, 1.0)
        ratio = np.where(self.logarithmic, self.upper / self.lower, np.e)
        evenly = (values - self.lower) / (self.upper - self.lower)
        return np.where(self.logarithmic, np.log(safe) / np.log(ratio), evenly)

    def moved(self, at: Any) -> Isolator:
        """Give the isolator at a point."""
        numbers = [entry.value for entry in list_parameters(self.model)]
        for place, value in zip(self.places, self.values(at), strict=True):
            numbers[place] = value
        return replace_parameters(self.model, numbers)

    def words(self, at: Float[np.ndarray, " coordinate"]) -> str:
        """Give the coefficients at a point in words."""
        listed = list_parameters(self.model)
        return ", ".join(
            f"{name} = {number(float(value))} {listed[place].spec.unit}"
            for name, place, value in zip(self.names, self.places, self.values(at), strict=True)
        )


def space_of(model: Isolator, free: Mapping[str, tuple[float, float]]) -> Space:
    """Give the coefficients that a design may choose.

    Args:
        model: the isolator.
        free: lower and upper bound by name.

    Returns:
        The space.

    Raises:
        ValueError: if a name is no parameter of the model, a bound is not finite, outside of what the
            coefficient admits or not below the other, or the model starts outside of its bounds.
    """
    listed = list_parameters(model)
    names = [entry.name for entry in listed]
    if not free:
        raise ValueError("Argument `free` must name at least one coefficient with its bounds, but is empty.")
    for name, bounds in free.items():
        if name not in names:
            raise ValueError(f"Argument `free` must name some of {', '.join(names)}, but names {name!r}.")
        entry = listed[names.index(name)]
        low, high = (float(one) for one in bounds)
        if not (np.isfinite(low) and np.isfinite(high) and low < high):
            raise ValueError(f"Argument `free` must bound {name} by two finite numbers, but by {bounds}.")
        if low < entry.spec.lower or high > entry.spec.upper:
            raise ValueError(
                f"Argument `free` must bound {name} within {entry.spec.lower:g} and {entry.spec.upper:g}, "
                f"but by {bounds}."
            )
        if not low <= float(entry.value) <= high:
            raise ValueError(
                f"Argument `model` must start within the bounds of {name}, {low:g} and {high:g}, but starts "
                f"at {float(entry.value):g}."
            )
    lower, upper = np.array([list(map(float, bounds)) for bounds in free.values()]).T
    places = tuple(names.index(name) for name in free)
    return Space(model, tuple(free), places, lower, upper, lower * upper > 0.0)


class Answer(NamedTuple):
    """Numbers of a quantity at a point.

    Attributes:
        value: as the model has it.
        bound: value, or its end that lies at the limit with the chance asked for.
        slope: of that by the coordinates; not worked out where only values were asked for.
    """

    value: Float[np.ndarray, " number"]
    bound: Float[np.ndarray, " number"]
    slope: Float[np.ndarray, "number coordinate"] | None = None


class Quantity:
    """A quantity over the space, with exact derivatives by its coordinates."""

    def __init__(
        self,
        space: Space,
        quantity: Callable[[Isolator], Any],
        name: str,
        constraint: Constraint | None = None,
        errors: CoefficientErrors | None = None,
    ):
        """Keep what is asked; nothing is evaluated yet."""
        self.space, self.name, self.constraint = space, name, constraint
        self.evaluations = 0
        self._function = quantity
        self._errors = errors if constraint is not None and constraint.chance is not None else None
        self._known: dict[tuple[bytes, bool], Answer] = {}

    def at(self, at: Float[np.ndarray, " coordinate"], slopes: bool = True) -> Answer:
        """Give the quantity at a point.

        Args:
            at: the point.
            slopes: whether its derivatives are wanted.

        Returns:
            The answer.

        Raises:
            NotFinite: if a number is not, or if the function raises what it did not raise elsewhere.
        """
        place = at.tobytes()
        known = self._known.get((place, True)) or self._known.get((place, slopes))
        if known is None:
            self.evaluations += 1
            known = self._tried(at, slopes)
            if not all(np.all(np.isfinite(one)) for one in known if one is not None):
                raise NotFinite(at, f"{self.name} is not finite at {self.space.words(at)}")
            self._known[place, slopes] = known
        return known

    def _tried(self, at: Float[np.ndarray, " coordinate"], slopes: bool) -> Answer:
        try:
            return self._answer(at, slopes)
        except Exception as error:
            if not self._known:
                raise
            # It worked before: a fold that is gone, for one, is no mistake in the function.
            said = f"{type(error).__name__} {error}".strip()
            raise NotFinite(at, f"{self.name} raised {said} at {self.space.words(at)}") from error

    def _answer(self, at: Float[np.ndarray, " coordinate"], slopes: bool) -> Answer:
        if slopes:
            slope, value = map(np.asarray, jax.jacfwd(self._twice, has_aux=True)(jnp.asarray(at)))
        else:
            slope, value = None, np.asarray(self._flat(jnp.asarray(at)))
        if self._errors is None or self.constraint is None or self.constraint.chance is None:
            return Answer(value, value, slope)
        sign = 1.0 if self.constraint.upper else -1.0
        width = sign * float(ndtri(self.constraint.chance))
        error = self._error(at)
        bound = value + width * error
        if slope is not None:
            moves = np.where(at > 0.5, -_STEP, _STEP)
            turned = [self._error(at + step) for step in np.diag(moves)]
            change = (np.stack(turned, axis=1) - error[:, None]) / moves
            slope = slope + width * change
        return Answer(value, bound, slope)

    def _flat(self, at: Array) -> Array:
        return jnp.ravel(jnp.asarray(self._function(self.space.moved(at)), dtype=float))

    def _twice(self, at: Array) -> tuple[Array, Array]:
        value = self._flat(at)
        return value, value

    def _error(self, at: Float[np.ndarray, " coordinate"]) -> Float[np.ndarray, " number"]:
        """Give the standard error of each number; the coefficients have the relative errors of the fit."""
        errors = self._errors
        assert errors is not None
        absent = errors.values == 0.0
        relative = errors.root / np.where(absent, 1.0, errors.values)[:, None]

        def shaken(steps: Array) -> Array:
            model = self.space.moved(at)
            numbers = [entry.value for entry in list_parameters(model)]
            for place, share, gone in zip(errors.places, relative @ steps, absent, strict=True):
                numbers[place] = numbers[place] + share if gone else numbers[place] * (1.0 + share)
            return jnp.ravel(jnp.asarray(self._function(replace_parameters(model, numbers)), dtype=float))

        return np.linalg.norm(np.asarray(jax.jacfwd(shaken)(jnp.zeros(errors.steps))), axis=1)
