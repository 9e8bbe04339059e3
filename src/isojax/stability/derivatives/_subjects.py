"""What can be differentiated: orbits, maps, special points and functions, all seen in one way."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, cast

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ...excitations import Harmonic
from ...models import Isolator
from ..branch import ParameterFamily, PointGuess, SpecialPoint, special_point
from ..map import StabilityMap
from ..orbit import Orbit, find_periodic_orbit
from ._map_derivatives import map_slopes
from ._parameter_values import differentiate, drive_values, with_values

Derivatives = tuple[Mapping[str, Array], Mapping[str, Array]]
"""Quantities by name, and their derivatives, parameter first."""


class Subject(NamedTuple):
    """What `sensitivity` asks of whatever it differentiates.

    Attributes:
        model: the isolator.
        drive: amplitude and frequency; NaN where they differ from cell to cell, None where there is no drive.
        solved: parameters that the subject solves for, by which it cannot be differentiated.
        slopes: quantities and derivatives by parameters, from the names and values of these.
    """

    model: Isolator
    drive: tuple[Array, Array] | None
    solved: tuple[str, ...]
    slopes: Callable[[tuple[str, ...], Array], Derivatives]


def _of_orbit(orbit: Orbit) -> Subject:
    drive = (jnp.asarray(orbit.excitation.amplitude), jnp.asarray(orbit.excitation.frequency))
    symmetric = bool(jnp.all(jnp.isfinite(orbit.floquet.half_period_multipliers)))
    return Subject(
        orbit.model, drive, (), lambda names, at: _orbit_slopes(orbit, drive, symmetric, names, at)
    )


@eqx.filter_jit
def _orbit_slopes(
    orbit: Orbit, drive: tuple[Array, Array], symmetric: bool, names: tuple[str, ...], at: Array
) -> Derivatives:
    def quantities(numbers: Array) -> dict[str, Array]:
        found = find_periodic_orbit(
            with_values(orbit.model, names, numbers),
            Harmonic(*drive_values(names, numbers, drive)),
            start=orbit.y0,
            periods=orbit.periods,
            symmetric=symmetric,
        )
        return {
            "y0": found.y0,
            "amplitude": found.amplitude,
            "multipliers": found.floquet.multipliers,
            "spectral_radius": found.floquet.spectral_radius,
        }

    return differentiate(quantities, at)


def _of_map(smap: StabilityMap) -> Subject:
    # Differentiated cell by cell, at each cell's own drive.
    drive = (jnp.asarray(jnp.nan), jnp.asarray(jnp.nan))
    return Subject(smap.model, drive, (), lambda names, at: map_slopes(smap, names))


def _of_point(point: SpecialPoint) -> Subject:
    family = point.family
    fixed = (jnp.asarray(family.amplitude), jnp.asarray(family.frequency))
    guess = PointGuess(jax.lax.stop_gradient(point.y0), family.shares(point.value[None]))
    solved = tuple(f"drive.{own}" if own in ("amplitude", "frequency") else own for own in family.names)

    def slopes(names: tuple[str, ...], at: Array) -> Derivatives:
        def quantities(numbers: Array) -> dict[str, Array]:
            model, drive = with_values(family.model, names, numbers), drive_values(names, numbers, fixed)
            there = ParameterFamily(model, *drive, family.start, family.stop, family.names)
            found = special_point(there, point.method, point.kind, point.branch, guess)
            return {"value": found.value, "y0": found.y0}

        return differentiate(quantities, at)

    return Subject(family.model, (point.amplitude, point.frequency), solved, slopes)


def _of_function(function: Callable[[Isolator], Mapping[str, Array] | Array], model: Isolator) -> Subject:
    def slopes(names: tuple[str, ...], at: Array) -> Derivatives:
        def quantities(numbers: Array) -> Mapping[str, Array]:
            given = function(with_values(model, names, numbers))
            return given if isinstance(given, Mapping) else {"value": jnp.asarray(given)}

        return differentiate(quantities, at)

    return Subject(model, None, (), slopes)


_ADAPTERS: dict[type, Callable[..., Subject]] = {
    Orbit: _of_orbit,
    StabilityMap: _of_map,
    SpecialPoint: _of_point,
}
"""How each result of the package is seen as a subject; all else is a function of a model."""


def as_subject(what: object, model: Isolator | None) -> Subject:
    """Give what `sensitivity` was asked about as a subject.

    Args:
        what: a result that carries its own model, or a function of a model.
        model: the isolator, where `what` is a function.

    Returns:
        The subject.

    Raises:
        ValueError: if `model` is missing or superfluous.
    """
    known = _ADAPTERS.get(type(what))
    if (known is None) == (model is None):
        raise ValueError(
            "Argument `model` must be given where `subject` is a function, and only there, but is "
            f"{'missing' if model is None else 'given'}."
        )
    return _of_function(cast("Any", what), cast("Isolator", model)) if known is None else known(what)
