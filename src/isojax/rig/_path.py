"""The path of an integration: the interpolant of every step, evaluated at any instants afterwards."""

from typing import Any, no_type_check

import numpy as np
from jaxtyping import Bool, Float

_BLOCK = 65536


@no_type_check
def powers(shares):
    """Basis of the order-7 interpolant of Dormand-Prince 8(5,3), seven functions of the share of a step.

    Source: Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, II.6: alternating factors s
    and 1 - s.
    """
    rest = 1 - shares
    columns = [shares]
    for k in range(6):
        columns.append(columns[-1] * (rest if k % 2 == 0 else shares))
    return columns


class Path:
    """Steps of one integration in the order of time."""

    def __init__(self) -> None:
        self._steps: list[tuple[Any, ...]] = []

    @property
    def steps(self) -> int:
        """Number of steps."""
        return len(self._steps)

    @no_type_check
    def add(self, start, size, state, coefficients, sides, stuck):
        """Keep one step: the interpolant over [start, start + size] is valid until the next step starts."""
        self._steps.append((start, size, state, coefficients, tuple(sides), stuck))

    def at(
        self, times: Float[np.ndarray, " time"]
    ) -> tuple[Float[np.ndarray, "state time"], Float[np.ndarray, "switch time"], Bool[np.ndarray, " time"]]:
        """State, sides and whether stuck at each instant (increasing); before the path the plant is held.

        Args:
            times: s.

        Returns:
            States (state, time), sides (switch, time), stuck (time,).
        """
        starts, sizes, states, coefficients, sides, stuck = (
            np.array(column) for column in zip(*self._steps, strict=True)
        )
        which = np.maximum(np.searchsorted(starts, times, side="right") - 1, 0)
        values = np.empty((states.shape[1], times.size))
        for first in range(0, times.size, _BLOCK):
            block = slice(first, first + _BLOCK)
            step = which[block]
            basis = powers(np.maximum((times[block] - starts[step]) / sizes[step], 0.0))
            # A function and a state at a time: five times as fast as all together, which would be gathered.
            for k in range(states.shape[1]):
                change = 0.0
                for function, coefficient in zip(basis, coefficients[:, k].T, strict=True):
                    change = change + function * np.take(coefficient, step)
                values[k, block] = np.take(states[:, k], step) + change
        return values, sides[which].T, stuck[which] | (times < starts[0])
