"""Steps that follow the states of a model all over the window of a map."""

from ...models import Integrator, Isolator
from ..orbit import integrator_over
from ._surface import MapWindow, displacements

_UNSTABLE = 4
"""Times the steps a period, beyond which a model that would need more makes them unstable."""


def window_integrator(model: Isolator, integrator: Integrator, window: MapWindow) -> Integrator:
    """Give an integrator with steps that follow the states of a model all over a window.

    Motions beyond those that the drives need do not count: their laws may change many times faster.

    Args:
        model: the isolator.
        integrator: with steps enough for motions that change no faster than the drive.
        window: of the map.

    Returns:
        The integrator.
    """
    sizes = displacements(model, window)
    return integrator_over(model, integrator, [sizes.least, sizes.grown], window.frequencies)


def check_steps(model: Isolator, integrator: Integrator, window: MapWindow) -> None:
    """Refuse steps that are unstable, which a map would read as orbits that are not there.

    Args:
        model: the isolator.
        integrator: of the caller.
        window: of the map.

    Raises:
        ValueError: if they are.
    """
    follows = window_integrator(model, integrator, window).steps_per_period
    if follows > _UNSTABLE * integrator.steps_per_period:
        raise ValueError(
            f"Argument `integrator` must take at least {follows // _UNSTABLE} steps a drive period here, "
            "because a state of the model follows the motion too fast for fewer, but takes "
            f"{integrator.steps_per_period}."
        )
