"""Coefficients that follow an operating condition, such as the chamber pressure, at given values of it."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, cast

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from .._given_numbers import given_scalar
from .._parameters import refuse_shapes_outside
from .._quantities import CONDITIONS
from .._show import number
from .._types import Scalar
from ..elements import AbstractElement, Dependence

_FARTHEST = 10.0
"""Factor on the reference of a law up to which a condition is taken: none was tested so far from it. One in
another unit, such as bar or degrees Celsius, lies beyond."""


def followed_conditions(elements: tuple[AbstractElement, ...]) -> tuple[str, ...]:
    """Name the operating conditions that some coefficient of these effects follows."""
    followed = (element.dependence() for element in elements)
    return tuple(sorted({one.condition for one in followed if one is not None}))


def _refuse_far(follows: Dependence, value: Scalar | float) -> None:
    """Refuse a condition far from the reference of a law: most often it is in another unit."""
    if isinstance(value, Tracer) or isinstance(follows.reference, Tracer):
        return
    reference = float(follows.reference)
    if not reference / _FARTHEST <= float(value) <= reference * _FARTHEST:
        raise ValueError(
            f"Argument `{follows.condition}` must be absolute, in its SI unit, and within a factor of "
            f"{_FARTHEST:g} of {reference:g}, the reference of the law that follows it, but is {value}."
        )


def _refuse_turned(
    before: Sequence[AbstractElement], after: Sequence[AbstractElement], conditions: Mapping[str, Any]
) -> None:
    """Refuse conditions that turn the sign of a linear spring or damper: no record showed the law so far."""
    for one, other in zip(before, after, strict=False):
        was, is_now = (getattr(element, element.strength) for element in (one, other))
        if not one.proportional_to or isinstance(was, Tracer) or isinstance(is_now, Tracer):
            continue
        if np.any(np.asarray(was) * np.asarray(is_now) < 0.0):
            at = " and ".join(f"{name}={value}" for name, value in conditions.items())
            raise ValueError(
                f"Argument `{next(iter(conditions))}` must lie where the fitted laws hold, but at {at} they "
                f"turn {one.name} from {float(was):.4g} to {float(is_now):.4g}."
            )


def untested_words(fit: object, conditions: Mapping[str, Scalar | float]) -> str:
    """Say which conditions lie beyond those of the records that were fitted.

    Args:
        fit: what knows the `tested_conditions`, or ends with it, as a closed loop does; of any other, nothing
            is known.
        conditions: the value of each [SI].

    Returns:
        A sentence; "" where all were tested, or nothing is known.
    """
    tested: Mapping[str, tuple[float, float]] = getattr(getattr(fit, "after", fit), "tested_conditions", {})
    beyond = [
        f"{name} {number(float(value))} {CONDITIONS[name]} lies beyond the {number(tested[name][0])} to "
        f"{number(tested[name][1])} {CONDITIONS[name]} of the fitted records"
        for name, value in conditions.items()
        if name in tested and not isinstance(value, Tracer)
        if not tested[name][0] <= float(value) <= tested[name][1]
    ]
    return f"{' and '.join(beyond)}: the laws are carried on untested" if beyond else ""


def plain_elements(
    elements: tuple[AbstractElement, ...], conditions: Mapping[str, Scalar | float]
) -> tuple[AbstractElement, ...]:
    """Give effects at operating conditions: what follows them goes into plain coefficients.

    Args:
        elements: the effects.
        conditions: value of every condition that is followed, and of no other [SI].

    Returns:
        The effects that follow none, with what the others add to their strengths.

    Raises:
        ValueError: if a condition is missing, follows nothing, is not one positive number, is far from the
            reference of a law, or turns the sign of a linear spring or damper; if a shape of an effect lies
            outside its bounds.
    """
    known = followed_conditions(elements)
    for name, value in conditions.items():
        if name not in known:
            followed = " and ".join(known) if known else "nothing"
            raise ValueError(f"Argument `{name}` must not be given: the model follows {followed}.")
        one = given_scalar(name, value)
        if not isinstance(one, Tracer) and not 0.0 < one < math.inf:
            raise ValueError(f"Argument `{name}` must be positive and finite, but is {value}.")
    for name in known:
        if name not in conditions:
            raise ValueError(f"Argument `{name}` must be given: a coefficient of the model follows it.")
    refuse_shapes_outside((element.name for element in elements), elements)
    before = tuple(element for element in elements if element.dependence() is None)
    plain = list(before)
    for follows in (element.dependence() for element in elements):
        if follows is None:
            continue
        law = cast(AbstractElement, follows.law)
        _refuse_far(follows, conditions[follows.condition])
        share = follows.share(jnp.asarray(conditions[follows.condition], dtype=float))
        place = next((place for place, one in enumerate(plain) if one.name == law.name), len(plain))
        strength = share * getattr(law, law.strength)
        if place < len(plain):
            strength = getattr(plain[place], law.strength) + strength
        plain[place : place + 1] = [eqx.tree_at(lambda one: getattr(one, one.strength), law, strength)]
    _refuse_turned(before, plain, conditions)
    return tuple(plain)
