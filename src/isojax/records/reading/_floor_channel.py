"""The acceleration of the floor, whatever of its motion was measured."""

import numpy as np
import scipy
from jaxtyping import Float

from .._campaign import TIME_DERIVATIVES, OutputQuantity

_DEGREE = 7


def floor_acceleration(
    motion: Float[np.ndarray, " time"], rate: float, quantity: OutputQuantity
) -> Float[np.ndarray, " time"]:
    """Gives the acceleration of a measured motion of the floor, about its mean.

    A velocity or a displacement is differentiated on a spline of degree 7: to 1e-3 up to an eighth of the
    sampling rate. A mean acceleration is an offset of the sensor, since the floor stays where it is.

    Args:
        motion: What was measured [m/s^2, m/s or m], (time,).
        rate: Samples per second [Hz].
        quantity: What it is.

    Returns:
        Acceleration [m/s^2], (time,).
    """
    order = TIME_DERIVATIVES["acceleration"] - TIME_DERIVATIVES[quantity]
    if order:
        time = np.arange(motion.size) / rate
        spline = scipy.interpolate.make_interp_spline(time, motion - np.mean(motion), k=_DEGREE)
        motion = spline.derivative(order)(time)
    return motion - np.mean(motion)
