"""Sizes of the errors, and a filter's way along the records with them."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ._filter import Trace

SPACING = 0.05
"""Difference of the logarithm of a size over which the likelihood is differentiated."""

_RIDGE = 1e-3
"""Share of its own information that each size has beside it: those that depend on each other stay apart."""

FURTHEST = 3.0
"""Longest step of the logarithm of a size."""


class Sizes(NamedTuple):
    """Sizes of the errors.

    Attributes:
        force: variance of what is new in the random force at each sample, log [squared SI unit of the drive];
            common to the records.
        memory: its correlation time, log [samples]; white from sample to sample where it is short.
        noise: variance of the output's noise in each record, log [squared SI unit of the output].
    """

    force: float
    memory: float
    noise: Float[np.ndarray, " record"]

    def around(self) -> tuple["Sizes", ...]:
        """Give these sizes, and each a little larger and a little smaller."""
        ups = (SPACING, -SPACING)
        return (
            self,
            *(self._replace(force=self.force + up) for up in ups),
            *(self._replace(memory=self.memory + up) for up in ups),
            *(self._replace(noise=self.noise + up) for up in ups),
        )

    def moved(
        self,
        way: "Way",
        judged: Float[np.ndarray, " record"],
        bounds: tuple["Sizes", "Sizes"],
        furthest: float,
    ) -> "Sizes":
        """Give the sizes after a step of Fisher's scoring.

        Of innovations that scale with a size the step is the logarithm of one plus the linear one, exactly.

        Args:
            way: the filter with these sizes, and its slopes with them.
            judged: 1 for the records that are fitted, 0 for those that take no part.
            bounds: smallest and largest sizes.
            furthest: longest step.

        Returns:
            The sizes, within their bounds.
        """
        count = judged.size
        # A record that takes no part may have diverged.
        slopes, information = (np.where(np.isfinite(one), one, 0.0) for one in (way.slope, way.fisher))
        here, lower, upper = (np.r_[one.force, one.memory, one.noise] for one in (self, *bounds))
        slope = np.concatenate([(slopes[:2] * judged).sum(axis=1), slopes[2]])
        fisher = np.zeros((2 + count, 2 + count))
        fisher[:2, :2] = (information[:2, :2] * judged).sum(axis=-1)
        fisher[:2, 2:] = information[:2, 2] * judged
        fisher[2:, :2] = fisher[:2, 2:].T
        fisher[range(2, 2 + count), range(2, 2 + count)] = information[2, 2]
        fisher += _RIDGE * np.diag(np.diag(fisher)) + np.eye(2 + count)
        # What stands at a bound and pushes against it stays there, and the others do not count on it.
        held = ((here <= lower) & (slope >= 0.0)) | ((here >= upper) & (slope <= 0.0))
        free, step = np.flatnonzero(~held), np.zeros(2 + count)
        step[free] = -np.linalg.solve(fisher[np.ix_(free, free)], slope[free])
        # Records show the density below the force's bandwidth; its new part and its memory move along that.
        left, fade = _unlike(self.memory)
        step[0] -= 2.0 * fade * step[1]
        # Shortened as a whole: sizes that depend on each other keep the direction.
        longest = np.where(step < 0.0, -np.expm1(-furthest), np.expm1(furthest))
        step = step * min(1.0, float(np.min(longest / np.maximum(np.abs(step), 1e-300))))
        moved = here + np.log1p(step)
        memory = float(np.clip(moved[1], lower[1], upper[1]))
        force = float(moved[0]) + 2.0 * (_unlike(memory)[0] - left)
        return Sizes(force, memory, moved[2:]).within(bounds)

    def within(self, bounds: tuple["Sizes", "Sizes"]) -> "Sizes":
        """Give the sizes that lie nearest, between the smallest and the largest."""
        force, memory, noise = (np.clip(*each) for each in zip(self, *bounds, strict=True))
        return Sizes(float(force), float(memory), noise)

    def distance(self, other: "Sizes") -> float:
        """Give the largest difference of the logarithm of a size."""
        apart = (np.max(np.abs(one - another)) for one, another in zip(self, other, strict=True))
        return float(max(apart))

    @property
    def correlation(self) -> float:
        """Correlation of the random force from sample to sample."""
        return float(np.exp(-np.exp(-self.memory)))

    @property
    def variance(self) -> float:
        """Variance of the random force [squared SI unit of the drive]."""
        return float(np.exp(self.force) / (1.0 - self.correlation**2))


def _unlike(memory: float) -> tuple[float, float]:
    """Give the logarithm of one less the correlation from sample to sample, and its slope with the memory."""
    rate = np.exp(-memory)
    return float(np.log(-np.expm1(-rate))), float(-rate / np.expm1(rate))


class Way(NamedTuple):
    """A filter along the records.

    Attributes:
        deviance: at each point and record; infinite where the filter diverged.
        squares: mean square of each internal state at the first point.
        slope: of half the deviance of each record there with the sizes.
        fisher: its information.
        correlation: of the random force there, from sample to sample.
        traces: of each batch, at the first point.
    """

    deviance: Float[np.ndarray, "copy record"]
    squares: Float[np.ndarray, "internal record"]
    slope: Float[np.ndarray, "size record"]
    fisher: Float[np.ndarray, "size size record"]
    correlation: float
    traces: list[Trace]

    @property
    def surprise(self) -> float:
        """Sum of squared innovations over those that they are weighed by."""
        return float(sum(np.sum(np.square(np.asarray(one.error / one.deviation))) for one in self.traces))
