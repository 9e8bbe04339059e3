"""Where a simulation stands, and along which directions it is differentiated."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._parameters import find_parameter, list_parameters, replace_parameters
from ...elements import CATALOGUE
from ...models import Isolator, State


class Unknowns(NamedTuple):
    """Where the simulation stands and along which directions it is differentiated.

    Attributes:
        model: the isolator.
        directions: changes of the model's parameters, one column each, in the order of `list_parameters`.
        stiffness_scale: factor on the linear stiffness, a lane each.
        states: state at each lane's first sample.
        state_scales: size of one unit of change of each state.
    """

    model: Isolator
    directions: Float[np.ndarray, "parameter column"]
    stiffness_scale: Float[np.ndarray, " lanes"]
    states: Float[np.ndarray, "state lanes"]
    state_scales: Float[np.ndarray, "state lanes"]

    @property
    def moving(self) -> tuple[int, ...]:
        """Places of the parameters that some direction changes."""
        return tuple(int(place) for place in np.flatnonzero(self.directions.any(axis=1)))


class Lanes(NamedTuple):
    """Where segments side by side start, a lane each.

    Attributes:
        model: the isolator.
        stiffness_scale: factor on the linear stiffness.
        states: state at the first sample.
    """

    model: Isolator
    stiffness_scale: Float[Array, " lanes"]
    states: State


STIFFNESS_SCALE_UNIT = 1e-3
"""One unit of the column of the stiffness scale: a tenth of a percent."""


def stiffness_place(model: Isolator) -> int | None:
    """Give the place of the linear stiffness in `list_parameters`; None where the model has no such spring.

    Args:
        model: the isolator.

    Returns:
        The place.
    """
    spring = next((one for one in model.elements if one.proportional_to == "displacement"), None)
    return None if spring is None else find_parameter(model, f"{spring.name}.{spring.strength}")


def with_zero(model: Isolator) -> tuple[Isolator, int]:
    """Give a model whose sensor has a zero error, and its place in `list_parameters`.

    Args:
        model: the isolator.

    Returns:
        The isolator, with the zero error last where it had none.
    """
    zero = next((one for one in model.elements if one.starts_at_mean), None)
    if zero is None:
        kind: Any = next(one for one in CATALOGUE.values() if one.starts_at_mean)
        zero = kind(0.0)
        model = Isolator(model.mass, (*model.elements, zero), model.excitation)
    return model, find_parameter(model, f"{zero.name}.{zero.strength}")


def scaled_model(model: Isolator, values: Sequence[Array], scale: Array) -> Isolator:
    """Give a model with other numbers, its linear stiffness scaled lane by lane.

    Args:
        model: the isolator.
        values: one value a parameter, in the order of `list_parameters`.
        scale: factor on the linear stiffness.

    Returns:
        The isolator.
    """
    numbers = list(values)
    place = stiffness_place(model)
    if place is not None:
        numbers[place] = numbers[place] * scale
    return replace_parameters(model, numbers)


def has_stiffness_scale(model: Isolator) -> bool:
    """Say whether the model has a linear spring, whose stiffness may differ from record to record.

    Args:
        model: the isolator.

    Returns:
        True if it has.
    """
    return stiffness_place(model) is not None


class Changes(NamedTuple):
    """One unit of change of each unknown: a column each.

    Attributes:
        parameters: of each parameter that moves.
        scale: of the stiffness scale.
        states: of each initial state.
    """

    parameters: tuple[Float[Array, " column"], ...]
    scale: Float[Array, "column lanes"]
    states: tuple[Float[Array, "column lanes"], ...]


def unit_changes(
    model: Isolator, directions: Float[Array, "moving coefficient"], state_scales: State
) -> Changes:
    """Give the changes of all unknowns.

    Args:
        model: the isolator.
        directions: changes of the parameters that move, over the columns of the coefficients.
        state_scales: size of one unit of change of each state, a lane each.

    Returns:
        The changes: the coefficients first, then the stiffness scale, if there is one, and the states.
    """
    has_scale, lanes = has_stiffness_scale(model), state_scales[0].shape[0]
    columns = directions.shape[1]
    total = columns + int(has_scale) + len(state_scales)
    seeds = tuple(jnp.concatenate([seed, jnp.zeros(total - columns)]) for seed in directions)
    scale_seed = jnp.zeros((total, lanes))
    if has_scale:
        scale_seed = scale_seed.at[columns].set(STIFFNESS_SCALE_UNIT)
    tangents = tuple(
        jnp.zeros((total, lanes)).at[total - len(state_scales) + index].set(unit)
        for index, unit in enumerate(state_scales)
    )
    return Changes(seeds, scale_seed, tangents)


def movable(
    model: Isolator, moving: tuple[int, ...]
) -> tuple[tuple[Array, ...], Callable[[tuple[Array, ...]], tuple[Array, ...]]]:
    """Give the parameters that move, and the function that puts others in their places.

    Only what moves is differentiated: the rest would cost as much and give zeros.
    """
    values = tuple(entry.value for entry in list_parameters(model))

    def with_moved(moved: tuple[Array, ...]) -> tuple[Array, ...]:
        numbers = list(values)
        for place, number in zip(moving, moved, strict=True):
            numbers[place] = number
        return tuple(numbers)

    return tuple(values[place] for place in moving), with_moved
