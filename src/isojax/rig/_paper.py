"""The plants and the test plan of the paper, typed in from its printed coefficients.

Source: "Data-driven modeling and analysis of nonlinear isolated mechanical system", the averages of its
forward and backward sweeps, with the damping of equations (18) and (28); 800 kg.
"""

from typing import Literal

import numpy as np

from ._plant import Plant, base_laws
from ._sine_plans import SteppedSine


def y_plant() -> Plant:
    """The horizontal direction."""
    return Plant(base_laws(1.0805e6, -6.974e8, 2.51667e11, 1.027e4, -3.6880e5, 5.3753e6))


def z_plant() -> Plant:
    """The vertical direction."""
    return Plant(base_laws(1.414e5, -4.126e5, -4.289e6, 2638.0, -1393.0, 745.533))


def paper_plan(
    direction: Literal["y", "z"] = "y",
    levels: tuple[float, ...] = (40.0, 80.0, 120.0, 160.0, 200.0),
    repeats: int = 3,
    holdout_levels: tuple[float, ...] = (),
) -> SteppedSine:
    """The paper's test: 0.1 Hz steps of 20 cycles, forward and backward, 4-7 Hz in y or 1.5-4 Hz in z.

    Args:
        direction: "y" or "z".
        levels: force amplitudes, N; the paper does not print its own.
        repeats: of each level and direction.
        holdout_levels: further force amplitudes that are held out, N, with one repeat.

    Returns:
        The plan.
    """
    tenths = np.arange(40, 71) if direction == "y" else np.arange(15, 41)
    frequencies = tuple((tenths / 10).tolist())
    return SteppedSine(levels, frequencies, 20, repeats=repeats, holdout_levels=holdout_levels)
