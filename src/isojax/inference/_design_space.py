"""The coefficients of a design in coordinates from 0 to 1, and quantities with their derivatives by these."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .._given_numbers import asked_numbers, given_numbers
from .._parameters import find_parameter, full_names, list_parameters, own_parameters, replace_parameters
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
    one of 1e11 weigh alike. Operating conditions that the model follows, such as the pressure, go last.

    Attributes:
        model: the isolator.
        names: of the free coefficients and conditions.
        units: of each.
        places: of the coefficients in `list_parameters`.
        before: value of each at the start.
        lower: smallest values.
        upper: largest values.
        logarithmic: whether each moves along its logarithm.
    """

    model: Isolator
    names: tuple[str, ...]
    units: tuple[str, ...]
    places: tuple[int, ...]
    before: Float[np.ndarray, " coordinate"]
    lower: Float[np.ndarray, " coordinate"]
    upper: Float[np.ndarray, " coordinate"]
    logarithmic: Bool[np.ndarray, " coordinate"]

    def values(self, at: Any) -> Array:
        """Give the coefficients at a point."""
        logarithmic, safe = jnp.asarray(self.logarithmic), np.where(self.logarithmic, self.lower, 1.0)
        ratio = np.where(self.logarithmic, self.upper, 1.0) / safe
        evenly = self.lower + (self.upper - self.lower) * at
        return jnp.where(logarithmic, safe * ratio**at, evenly)

    def distance(self, at: Any) -> Array:
        """Give the sum of the squared relative changes of a point against the start."""
        size = np.where(self.before == 0.0, self.upper - self.lower, np.abs(self.before))
        return jnp.sum(((self.values(at) - self.before) / size) ** 2)

    def coordinates(self, values: Float[np.ndarray, " coordinate"]) -> Float[np.ndarray, " coordinate"]:
        """Give the point of given coefficients."""
        place, log = (values - self.lower) / (self.upper - self.lower), self.logarithmic
        place[log] = np.log(values[log] / self.lower[log]) / np.log(self.upper[log] / self.lower[log])
        return place

    def moved(self, at: Any, shaken: Callable[[list[Any]], list[Any]] = list) -> Isolator:
        """Give the isolator at a point.

        Args:
            at: the point.
            shaken: changes the numbers of `list_parameters`.

        Returns:
            The isolator, at the conditions that are free.
        """
        numbers, values = [entry.value for entry in list_parameters(self.model)], self.values(at)
        for place, value in zip(self.places, values, strict=False):
            numbers[place] = value
        model, conditions = replace_parameters(self.model, shaken(numbers)), self.conditions(values)
        return model.at(**conditions) if conditions else model

    def conditions(self, values: Any) -> dict[str, Any]:
        """Give the operating conditions among the values of a point, by name."""
        count = len(self.places)
        return dict(zip(self.names[count:], values[count:], strict=True))

    def words(self, at: Float[np.ndarray, " coordinate"]) -> str:
        """Give the coefficients at a point in words."""
        return ", ".join(
            f"{name} = {number(float(value))} {unit}"
            for name, unit, value in zip(self.names, self.units, self.values(at), strict=True)
        )


class _Free(NamedTuple):
    """What a design may choose one of: value at the start, unit, and what it admits."""

    value: float
    unit: str
    lower: float
    upper: float


def _known_conditions(model: Isolator) -> dict[str, _Free]:
    """Give the operating conditions that a model follows, from their references."""
    found = {}
    for element in model.elements:
        follows = element.dependence()
        if follows is not None:
            unit = dict(own_parameters(element))["reference"].unit
            found[follows.condition] = _Free(float(follows.reference), unit, 0.0, np.inf)
    return found


def given_bounds(model: Isolator, free: Any) -> dict[str, tuple[float, float]]:
    """Give the bounds that a caller gave, by full name.

    Args:
        model: the isolator.
        free: lower and upper bound by name, symbol or operating condition.

    Returns:
        Both by name.

    Raises:
        ValueError: if these are no bounds, or a name is no parameter of the model and no condition that it
            follows, or names one again.
    """
    if not isinstance(free, Mapping) or not free:
        raise ValueError(
            "Argument `free` must give the bounds of at least one coefficient, such as {'k1': (1e5, 1e7)}, "
            f"but is {free!r}."
        )
    names = full_names(model, free, "free", *_known_conditions(model))
    return {name: _ends(name, ends) for name, ends in zip(names, free.values(), strict=True)}


def space_of(model: Isolator, free: Mapping[str, tuple[float, float]]) -> Space:
    """Give the coefficients and conditions that a design may choose.

    Args:
        model: the isolator.
        free: lower and upper bound by full name.

    Returns:
        The space. A condition starts at its reference, or at the bound next to it.

    Raises:
        ValueError: if a bound is outside of what the coefficient admits, or a coefficient starts outside of
            its bounds.
    """
    listed, conditions = list_parameters(model), _known_conditions(model)
    bounds: dict[str, tuple[_Free, float, float]] = {}
    places: list[int] = []
    for name, (low, high) in sorted(free.items(), key=lambda item: item[0] in conditions):
        if name in conditions:
            one = conditions[name]
            one = one._replace(value=min(max(one.value, low), high))
        else:
            place = find_parameter(model, name)
            spec = listed[place].spec
            places.append(place)
            one = _Free(float(listed[place].value), spec.unit, spec.lower, spec.upper)
        if low < one.lower or high > one.upper:
            raise ValueError(
                f"Argument `free` must bound {name} within {one.lower:g} and {one.upper:g}, but by {low:g} "
                f"and {high:g}."
            )
        if not low <= one.value <= high:
            raise ValueError(
                f"Argument `model` must start within the bounds of {name}, {low:g} and {high:g}, but starts "
                f"at {one.value:g}."
            )
        bounds[name] = one, low, high
    lower, upper = np.array([own[1:] for own in bounds.values()]).T
    return Space(
        model,
        tuple(bounds),
        tuple(one.unit for one, _, _ in bounds.values()),
        tuple(places),
        np.array([one.value for one, _, _ in bounds.values()]),
        lower,
        upper,
        lower * upper > 0.0,
    )


def _ends(name: str, ends: Any) -> tuple[float, float]:
    wanted = f"bound {name} by two finite numbers, the lower first"
    known = given_numbers("free", ends, wanted, np.isfinite)
    if known.shape != (2,) or not known[0] < known[1]:
        raise ValueError(f"Argument `free` must {wanted}, but is {ends}.")
    return float(known[0]), float(known[1])


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
        quantity: Callable[[Isolator], Any] | None,
        name: str,
        constraint: Constraint | None = None,
        errors: CoefficientErrors | None = None,
    ):
        """Keep what is asked; nothing is evaluated yet. No quantity is the distance from the start."""
        self.space, self.name, self.constraint = space, name, constraint
        self.evaluations = 0
        self._function, self._argument = quantity, "objective" if constraint is None else "quantity"
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
        room = self._room(at)
        bound = value + sign * room
        if slope is not None:
            moves = np.where(at > 0.5, -_STEP, _STEP)
            turned = [self._room(at + step) for step in np.diag(moves)]
            slope = slope + sign * (np.stack(turned, axis=1) - room[:, None]) / moves
        return Answer(value, bound, slope)

    def _flat(self, at: Array) -> Array:
        if self._function is None:
            return jnp.ravel(self.space.distance(at))
        return jnp.ravel(asked_numbers(self._argument, self._function, self.space.moved(at)))

    def _twice(self, at: Array) -> tuple[Array, Array]:
        value = self._flat(at)
        return value, value

    def _room(self, at: Float[np.ndarray, " coordinate"]) -> Float[np.ndarray, " number"]:
        """Give the room that the chance takes beside each number; relative errors are those of the fit."""
        errors, function = self._errors, self._function
        assert errors is not None
        assert self.constraint is not None
        assert self.constraint.chance is not None
        assert function is not None
        absent = errors.values == 0.0
        relative = errors.root / np.where(absent, 1.0, errors.values)[:, None]

        def shaken(steps: Array) -> Array:
            def shake(numbers: list[Any]) -> list[Any]:
                for place, share, gone in zip(errors.places, relative @ steps, absent, strict=True):
                    numbers[place] = numbers[place] + share if gone else numbers[place] * (1.0 + share)
                return numbers

            return jnp.ravel(asked_numbers(self._argument, function, self.space.moved(at, shake)))

        change = np.asarray(jax.jacfwd(shaken)(jnp.zeros(errors.steps)))
        return errors.coverage_factor(change, 1.0 - self.constraint.chance) * np.linalg.norm(change, axis=1)
