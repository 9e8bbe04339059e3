"""What can be differentiated: orbits, maps, special points and functions, all seen in one way."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, cast

import jax.numpy as jnp
from jaxtyping import Array

from ..._given_numbers import as_numbers, asked
from ...models import Isolator, as_isolator
from ..branch import CodimensionTwoPoint, SpecialPoint
from ..map import StabilityMap
from ..orbit import Orbit
from ..response import Resonance
from ._find_again import find_again
from ._map_slopes import map_slopes
from ._parameter_values import DRIVE, differentiate, drive_values, with_values


class Derivatives(NamedTuple):
    """Quantities and their derivatives.

    Attributes:
        values: the quantities, by name.
        slopes: their derivatives, parameter first.
        error: largest relative error of derivatives that were read off tables; None where none were.
    """

    values: Mapping[str, Array]
    slopes: Mapping[str, Array]
    error: float | None = None


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
    return _of_answer(orbit, orbit.model, drive, ())


def _of_resonance(resonance: Resonance) -> Subject:
    orbit = resonance.orbit
    drive = (jnp.asarray(orbit.excitation.amplitude), jnp.asarray(resonance.frequency))
    return _of_answer(resonance, orbit.model, drive, (DRIVE[1],))


def _of_point(point: SpecialPoint) -> Subject:
    family = point.family
    solved = tuple(f"drive.{own}" if own in ("amplitude", "frequency") else own for own in family.names)
    drive = (jnp.asarray(point.amplitude), jnp.asarray(point.frequency))
    return _of_answer(point, family.model, drive, solved)


def _of_codimension_two(point: CodimensionTwoPoint) -> Subject:
    drive = (jnp.asarray(point.amplitude), jnp.asarray(point.frequency))
    return _of_answer(point, point.family.model, drive, DRIVE)


def _of_answer(answer: Any, model: Isolator, drive: tuple[Array, Array], solved: tuple[str, ...]) -> Subject:
    def slopes(names: tuple[str, ...], at: Array) -> Derivatives:
        def quantities(numbers: Array) -> dict[str, Array]:
            pushes = zip(DRIVE, drive_values(names, numbers, drive), strict=True)
            given = {name.removeprefix("drive."): value for name, value in pushes if name not in solved}
            found = find_again(answer, with_values(model, names, numbers), **given)
            return {name: quantity(found) for name, quantity in _QUANTITIES[type(answer)].items()}

        return Derivatives(*differentiate(quantities, at))

    return Subject(model, drive, solved, slopes)


def _of_map(smap: StabilityMap) -> Subject:
    def slopes(names: tuple[str, ...], at: Array) -> Derivatives:
        return Derivatives(*map_slopes(smap, names, at))

    return Subject(smap.model, (jnp.asarray(jnp.nan), jnp.asarray(jnp.nan)), (), slopes)


_QUANTITIES: dict[type, dict[str, Callable[[Any], Array]]] = {
    Orbit: {
        "y0": lambda orbit: orbit.y0,
        "amplitude": lambda orbit: orbit.amplitude,
        "multipliers": lambda orbit: orbit.floquet.multipliers,
        "spectral_radius": lambda orbit: orbit.floquet.spectral_radius,
    },
    SpecialPoint: {"value": lambda point: point.value, "y0": lambda point: point.y0},
    CodimensionTwoPoint: {
        "amplitude": lambda point: point.amplitude,
        "frequency": lambda point: point.frequency,
    },
    Resonance: {
        "amplitude": lambda resonance: resonance.amplitude,
        "frequency": lambda resonance: resonance.frequency,
        "spectral_radius": lambda resonance: resonance.orbit.floquet.spectral_radius,
    },
}
"""What is differentiated of each result, but of a map."""


def _of_function(function: Callable[[Isolator], Mapping[str, Array] | Array], model: Isolator) -> Subject:
    def slopes(names: tuple[str, ...], at: Array) -> Derivatives:
        def quantities(numbers: Array) -> Mapping[str, Array]:
            given = asked("subject", function, with_values(model, names, numbers))
            several = given if isinstance(given, Mapping) else {"value": given}
            return {name: as_numbers("subject", value, real=False) for name, value in several.items()}

        return Derivatives(*differentiate(quantities, at))

    return Subject(model, None, (), slopes)


_ADAPTERS: dict[type, Callable[..., Subject]] = {
    Orbit: _of_orbit,
    StabilityMap: _of_map,
    SpecialPoint: _of_point,
    CodimensionTwoPoint: _of_codimension_two,
    Resonance: _of_resonance,
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
        ValueError: if it is neither, or `model` is missing or superfluous.
    """
    known = _ADAPTERS.get(type(what))
    if (known is None) == (model is None):
        raise ValueError(
            "Argument `model` must be given where `subject` is a function, and only there, but is "
            f"{'missing' if model is None else 'given'}."
        )
    if known is not None:
        return known(what)
    if not callable(what):
        raise ValueError(
            "Argument `subject` must be an orbit, a map, a special point, a resonance or a function of an "
            f"isolator, but is of type {type(what).__name__}."
        )
    return _of_function(cast("Any", what), as_isolator(model, recorded=True))
