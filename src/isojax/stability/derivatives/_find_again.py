"""A known answer found again for another model: what JAX can trace, batch and differentiate."""

import dataclasses
from collections.abc import Callable
from typing import Any, TypeVar, get_args

import jax

from ..._given_numbers import given_scalar
from ..._parameters import element_names
from ..._show import listed
from ..._types import Scalar, as_float64, check_float64
from ...models import Isolator, Modelled, as_isolator
from ..branch import (
    BifurcationKind,
    CodimensionTwoPoint,
    SpecialPoint,
    find_bifurcation_again,
    find_codimension_two_again,
    find_orbit_again,
)
from ..map import StabilityMap, found_again
from ..orbit import Orbit, is_traced
from ..response import Resonance, Transmissibility, resonance_again, transmissibility_again

Answer = TypeVar(
    "Answer", Orbit, SpecialPoint, CodimensionTwoPoint, StabilityMap, Resonance, Transmissibility
)


def find_again(
    answer: Answer,
    model: Isolator | Modelled,
    *,
    amplitude: Scalar | float | None = None,
    frequency: Scalar | float | None = None,
) -> Answer:
    """Find a known orbit, bifurcation, cusp, resonance, transmissibility or map again for a model close by.

    From the known one by Newton's method, so that the shape of the answer is known beforehand: `jax.jit`,
    `jax.vmap`, `jax.jacfwd` and `jax.grad` go through, also where those that found it in the first place
    refuse. An orbit, or a bifurcation of a branch, is sought along the branch of the other model, so that it
    is found where it is, and nothing else where it is gone: past its fold an orbit is NaN, not the one to
    which the motion jumps. So is a resonance whose isola has vanished.

    Args:
        answer: an orbit; a special or possible point of a branch, such as a fold; a special point of a curve
            of bifurcations, such as a cusp; a resonance; a transmissibility; or a map, of which each cell is
            found again. Its numbers must be known: find it outside what JAX transforms.
        model: the isolator, with the same elements; its numbers may be traced.
        amplitude: of the drive, in place of that of the answer [N, or m/s^2 for base excitation].
        frequency: of the drive, in place of that of the answer [Hz].

    Returns:
        The answer for this model.

    Raises:
        ValueError: if `answer` is none of these or is traced, `model` has other elements, or a drive is no
            single number, or is given though the answer solves for it or it differs from cell to cell.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Newton's method from the known solution; derivatives by the implicit function theorem.

    Example:
        >>> import jax
        >>> model = ij.paper.y_direction()
        >>> branch = ij.continue_branch(model, parameter="amplitude", frequency=4.3, start=120.0, stop=200.0)
        >>> fold = branch.special_points[0]
        >>> slopes = jax.grad(lambda model: ij.find_again(fold, model).amplitude)(model)
        >>> bool(slopes["linear_stiffness.coefficient"] > 0.0)  # a stiffer spring jumps later
        True
    """
    isolator = as_isolator(model)
    check_float64()
    finders: dict[type, tuple[Any, Callable[[Any], Isolator]]] = {
        Orbit: (find_orbit_again, lambda orbit: orbit.model),
        SpecialPoint: (_special_point, lambda point: point.family.model),
        CodimensionTwoPoint: (_codimension_two, lambda point: point.family.model),
        StabilityMap: (_map, lambda smap: smap.model),
        Resonance: (_resonance, lambda resonance: resonance.orbit.model),
        Transmissibility: (_transmissibility, lambda curve: curve.orbits.model),
    }
    if type(answer) not in finders:
        raise ValueError(
            "Argument `answer` must be an orbit, a special point of a branch or of a curve of bifurcations, "
            f"a resonance, a transmissibility or a map, but is of type {type(answer).__name__}."
        )
    if is_traced(answer):
        raise ValueError(
            "Argument `answer` must hold known numbers, but JAX is tracing it. Find it outside the function "
            "that JAX transforms."
        )
    drive = [
        None if value is None else given_scalar(name, value)
        for name, value in (("amplitude", amplitude), ("frequency", frequency))
    ]
    finder, model_of = finders[type(answer)]
    _check_alike(model_of(answer), isolator)
    return finder(answer, isolator, *drive)


def _check_alike(known: Isolator, model: Isolator) -> None:
    """Refuse an isolator that is another by more than its numbers."""
    if jax.tree.structure(known) == jax.tree.structure(model):
        return
    own, other = (
        f"{listed(element_names(one), 20)} under {one.excitation.replace('_', ' ')}" for one in (known, model)
    )
    other = "others of their fields" if own == other else other
    raise ValueError(
        f"Argument `model` must differ from the isolator of `answer` in numbers only ({own}), but has "
        f"{other}."
    )


def _special_point(point: SpecialPoint, model: Isolator, amplitude: Any, frequency: Any) -> SpecialPoint:
    known = point.family
    kind = next((name for name in get_args(BifurcationKind) if name == point.kind), None)
    if kind is None:
        raise ValueError(
            "Argument `answer` must be a bifurcation where it is a special point, but is the event "
            f"{point.kind!r}."
        )
    for name, value in (("amplitude", amplitude), ("frequency", frequency)):
        if value is not None and name in known.names:
            raise ValueError(
                f"Argument `{name}` must be omitted where the point solves for it, but is {value}."
            )
    fixed = (
        known.amplitude if amplitude is None else amplitude,
        known.frequency if frequency is None else frequency,
    )
    family = dataclasses.replace(known, model=model, amplitude=fixed[0], frequency=fixed[1])
    return find_bifurcation_again(point, kind, family)


def _codimension_two(
    point: CodimensionTwoPoint, model: Isolator, amplitude: Any, frequency: Any
) -> CodimensionTwoPoint:
    for name, value in (("amplitude", amplitude), ("frequency", frequency)):
        if value is not None:
            raise ValueError(
                f"Argument `{name}` must be omitted for a {point.kind}, which solves for it, but is {value}."
            )
    return find_codimension_two_again(point, model)


def _map(smap: StabilityMap, model: Isolator, amplitude: Any, frequency: Any) -> StabilityMap:
    for name, value in (("amplitude", amplitude), ("frequency", frequency)):
        if value is not None:
            raise ValueError(f"Argument `{name}` must be omitted for a map, but is {value}.")
    return found_again(smap, model)


def _resonance(resonance: Resonance, model: Isolator, amplitude: Any, frequency: Any) -> Resonance:
    if frequency is not None:
        raise ValueError(
            f"Argument `frequency` must be omitted for a resonance, which solves for it, but is {frequency}."
        )
    return resonance_again(resonance, model, None if amplitude is None else as_float64(amplitude))


def _transmissibility(
    curve: Transmissibility, model: Isolator, amplitude: Any, frequency: Any
) -> Transmissibility:
    if frequency is not None:
        raise ValueError(f"Argument `frequency` must be omitted for a transmissibility, but is {frequency}.")
    return transmissibility_again(curve, model, None if amplitude is None else as_float64(amplitude))
