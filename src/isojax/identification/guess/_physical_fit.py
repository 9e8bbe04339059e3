"""Whether coefficients are physical, a spring and a damper, over the measured motion."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._quick_jit import quick_jit
from ..._types import on_device
from ...elements import AbstractElement
from ...models import Isolator
from ._force_balance import BalanceFit, with_strength

_NONLINEAR = 1.01
"""Power of the motion above which a force counts as nonlinear."""


def _static(model: Isolator) -> Isolator:
    """Give the model without effects that have internal states."""
    static = tuple(element for element in model.elements if element.internal_states == 0)
    return Isolator(model.mass, static, model.excitation)


@quick_jit
def _slope_and_powers(
    static: Isolator, x: Float[Array, " point"], v: Float[Array, " point"]
) -> tuple[Float[Array, " point"], Float[Array, "3 point"]]:
    """Give the tangent stiffness along `x` at rest [N/m], and the power of the damping along `v` [W].

    The power is that at both ends of `x` and in its middle, which is zero.
    """

    def force(x: Array, v: Array) -> Array:
        return static.restoring_force((x, v))

    still = jnp.zeros_like(x)
    _, slope = jax.jvp(lambda place: force(place, still), (x,), (jnp.ones_like(x),))
    places = [jnp.full_like(v, place) for place in (x[0], 0.0, x[-1])]
    return slope, jnp.stack([(force(here, v) - force(here, still)) * v for here in places])


def unphysical_side(model: Isolator, displacement: float, velocity: float, points: int = 41) -> str | None:
    """Say which side of a model is no spring, or no damper, over the measured range.

    A spring must have a positive tangent stiffness, df/dx > 0; a damper must dissipate energy, (f(x, v) -
    f(x, 0)) v >= 0. A model without a spring, or without a damper, cannot fail there.

    Args:
        model: the model.
        displacement: largest displacement measured [m].
        velocity: largest velocity measured [m/s].
        points: how many points of each range are checked.

    Returns:
        "stiffness", "damping", or None where both are physical.
    """
    span = np.linspace(-1.0, 1.0, points)
    slope, powers = _slope_and_powers(
        _static(model), on_device(displacement * span), on_device(velocity * span)
    )
    if np.any(np.asarray(slope) != 0) and not np.all(np.asarray(slope) > 0):
        return "stiffness"
    return None if np.all(np.asarray(powers) >= 0) else "damping"


def _degree(unit: AbstractElement, side: str, displacement: float, velocity: float) -> float:
    """Give the power of the motion with which a force grows on one side; zero where it does not act there."""

    def force(size: float) -> float:
        still = float(unit.force(jnp.asarray(size * displacement), jnp.asarray(0.0), ()))
        if side == "stiffness":
            return still
        return float(unit.force(jnp.asarray(size * displacement), jnp.asarray(size * velocity), ())) - still

    small, large = force(0.5), force(1.0)
    return float(np.log2(large / small)) if small * large > 0 else 0.0


def steepest(model: Isolator, side: str, displacement: float, velocity: float) -> str | None:
    """Name the effect on one side whose force grows fastest with the motion.

    Args:
        model: the model.
        side: "stiffness" or "damping".
        displacement: largest displacement measured [m].
        velocity: largest velocity measured [m/s].

    Returns:
        Catalogue name of the present effect of highest degree above one, or None where all are linear.
    """
    present = [
        element for element in _static(model).elements if float(getattr(element, element.strength)) != 0
    ]
    degrees = {
        element.name: _degree(with_strength(element, 1.0), side, displacement, velocity)
        for element in present
    }
    name = max(degrees, key=lambda name: degrees[name], default=None)
    return name if name is not None and degrees[name] > _NONLINEAR else None


def fit_physically(
    fit: Callable[[tuple[str, ...]], BalanceFit], names: tuple[str, ...], displacement: float, velocity: float
) -> tuple[BalanceFit, tuple[str, ...]]:
    """Fit, and fit again without the steepest effect of the failing side, until the result is physical.

    Args:
        fit: regression on given catalogue names.
        names: catalogue names to start with.
        displacement: largest displacement measured [m].
        velocity: largest velocity measured [m/s].

    Returns:
        The fit, and a sentence for each effect that was left out.
    """
    notes: list[str] = []
    found = fit(names)
    while (side := unphysical_side(found.model, displacement, velocity)) is not None:
        dropped = steepest(found.model, side, displacement, velocity)
        reason = (
            "a tangent stiffness that is not positive" if side == "stiffness" else "damping that adds energy"
        )
        span = f"within {displacement:.3g} m" if side == "stiffness" else f"within {velocity:.3g} m/s"
        if dropped is None:
            notes.append(f"The start has {reason} {span}, and no nonlinear term remains to be left out.")
            break
        notes.append(f"The regression gave {reason} {span}: {dropped} starts at zero instead.")
        names = tuple(name for name in names if name != dropped)
        found = fit(names)
    return found, tuple(notes)
