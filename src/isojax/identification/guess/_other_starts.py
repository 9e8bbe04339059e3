"""Starts of a search beside the first, where that may lie in another valley."""

import equinox as eqx
import numpy as np
from jaxtyping import Float

from ..._parameters import element_names, list_parameters
from ..._types import on_device
from ...elements import AbstractElement, Scales
from ...models import Isolator
from ._force_balance import with_strength

_SHARE_OF_MOTION = 0.5
"""Distance of the wells from zero, over the amplitude of a motion that hops between them."""


def linear_starts(model: Isolator, places: tuple[int, ...]) -> list[Float[np.ndarray, " coefficient"]]:
    """Give starts beside the first: its linear part, stiffer and softer, and with more damping.

    Args:
        model: the first start.
        places: coefficients to fit, in `list_parameters`.

    Returns:
        Values of these coefficients.
    """
    return [_scaled(model, places, *each) for each in ((1.0, 1.0), (1.0, 3.0), (0.7, 1.0), (1.4, 1.0))]


def wells_start(
    model: Isolator, places: tuple[int, ...], scales: Scales
) -> Float[np.ndarray, " coefficient"] | None:
    """Give a start with two wells: springs that push off zero and balance at half the amplitude of motion.

    There they are as stiff as the first start, which near one rest is right.

    Args:
        model: the first start.
        places: coefficients to fit, in `list_parameters`.
        scales: magnitudes of the records.

    Returns:
        Values of these coefficients; None where no nonlinear spring is to be fitted that could hold the mass.
    """
    listed, values = list_parameters(model), _scaled(model, places, -0.5, 1.0)
    parts = dict(zip(element_names(model), model.elements, strict=True))
    held = {f"{name}.{one.strength}": one for name, one in parts.items() if _hardens(one, scales)}
    holding = [place for place, row in enumerate(places) if listed[row].name in held]
    kinds, rest = _kinds(model), _SHARE_OF_MOTION * scales.displacement
    linear = [place for place, row in enumerate(places) if kinds.get(listed[row].name) == "displacement"]
    off = sum(values[place] for place in linear)
    if not (holding and off < 0.0):
        return None
    near = eqx.tree_at(lambda one: one.displacement, scales, rest)
    share = -off * rest / scales.force / len(holding)
    for place in holding:
        values[place] = share * held[listed[places[place]].name].typical_strength(near)
    return values


def _kinds(model: Isolator) -> dict[str, str]:
    """Give for each strength what its force is proportional to; "nonlinear" where to nothing."""
    pairs = zip(element_names(model), model.elements, strict=True)
    return {f"{name}.{one.strength}": one.proportional_to or "nonlinear" for name, one in pairs}


def _scaled(
    model: Isolator, places: tuple[int, ...], stiffer: float, damped: float
) -> Float[np.ndarray, " coefficient"]:
    """Give the linear part of a start, changed; shapes of effects and the mass are no strengths, and stay."""
    factors, kinds = {"displacement": stiffer, "velocity": damped, "nonlinear": 0.0}, _kinds(model)
    chosen = [list_parameters(model)[place] for place in places]
    return np.array([float(each.value) * factors.get(kinds.get(each.name, ""), 1.0) for each in chosen])


def _hardens(element: AbstractElement, scales: Scales) -> bool:
    """Say whether an element is an odd nonlinear spring, which a stronger one may turn into two wells."""
    if element.proportional_to or element.internal_states or not element.signed:
        return False
    one, reach = with_strength(element, 1.0), scales.displacement
    ahead, back, moving = (
        float(np.asarray(one.force(on_device(np.asarray(x)), on_device(np.asarray(v)), ())))
        for x, v in ((reach, 0.0), (-reach, 0.0), (0.0, scales.velocity))
    )
    return ahead == -back != 0.0 == moving
