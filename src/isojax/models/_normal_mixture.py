"""The law of fitted coefficients where it has longer tails than a normal one."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr, ndtri

from .._show import Row, shown

_WIDTH_BISECTIONS = 40

CONFIDENCE = 0.95
"""Chance that an interval of 1.96 standard errors is meant to hold the truth, which defines them."""

HALF_WIDTH = -float(ndtri(0.5 * (1.0 - CONFIDENCE)))
"""Of such an interval, in standard errors."""


@shown
class NormalMixture(NamedTuple):
    """A mixture of normal laws of the coefficients' deviations from their fitted values.

    Few records tell the scatter between them only roughly. Each part is the law that belongs to a scatter, or
    to some beside each other, and its weight is how probable these are.

    Attributes:
        weights: of the parts; they add up to one.
        means: of each part [unit of each coefficient].
        covariances: of each part [product of their units].
        scatters: standard deviation of the linear stiffness between records, of each part [relative].
    """

    weights: Float[np.ndarray, " part"]
    means: Float[np.ndarray, "part coefficient"]
    covariances: Float[np.ndarray, "part coefficient coefficient"]
    scatters: Float[np.ndarray, " part"]

    @property
    def standard_errors(self) -> Float[np.ndarray, " coefficient"]:
        """Half-width about each fitted value that holds 95 %, over 1.96 [unit of each coefficient]."""
        return self.half_width(np.eye(self.means.shape[1]), CONFIDENCE) / HALF_WIDTH

    def propagated(self, slopes: Float[np.ndarray, "quantity coefficient"]) -> "NormalMixture":
        """Give the law of quantities that are linear in the coefficients.

        Args:
            slopes: of each quantity by each coefficient.

        Returns:
            Their law.
        """
        covariances = np.einsum("ik,pkl,jl->pij", slopes, self.covariances, slopes)
        return self._replace(means=self.means @ slopes.T, covariances=covariances)

    def widened(self, changes: Float[np.ndarray, "part change coefficient"]) -> "NormalMixture":
        """Give the law with further independent changes of the coefficients.

        Args:
            changes: what each moves the coefficients by in one standard deviation, part by part.

        Returns:
            The law.
        """
        return self._replace(covariances=self.covariances + np.einsum("pci,pcj->pij", changes, changes))

    def half_width(
        self, slopes: Float[np.ndarray, "... coefficient"], confidence: float | Float[np.ndarray, "..."]
    ) -> Float[np.ndarray, "..."]:
        """Give the half-width about its fitted value that holds a linear quantity with some chance.

        Args:
            slopes: of each quantity by the coefficients.
            confidence: the chance.

        Returns:
            The half-widths.
        """
        means = slopes @ self.means.T
        spread = np.einsum("...k,pkl,...l->...p", slopes, self.covariances, slopes)
        return half_width(self.weights, means, np.sqrt(np.maximum(spread, 0.0)), confidence)

    def coverage_factor(
        self, slopes: Float[np.ndarray, "... coefficient"], tail: float | Float[np.ndarray, "..."]
    ) -> Float[np.ndarray, "..."]:
        """Give how many standard errors lie between a linear quantity and an end beyond which some chance is.

        Args:
            slopes: of each quantity by the coefficients.
            tail: the chance beyond, on one side.

        Returns:
            The coverage factor: 1.96 for 0.025, whatever the law; negative for more than a half.

        Source: JCGM 100:2008, sec. 6.2 (coverage factor).
        """
        standard = self.half_width(slopes, CONFIDENCE)
        tail = np.broadcast_to(np.asarray(tail, dtype=float), standard.shape)
        width = self.half_width(slopes, np.abs(1.0 - 2.0 * tail))
        moves = standard > 0.0
        share = np.where(moves, width / np.where(moves, standard, 1.0) * HALF_WIDTH, 0.0)
        return np.where(moves, np.sign(0.5 - tail) * share, -ndtri(tail))

    def draw(
        self, uniform: Float[np.ndarray, " draw"], normal: Float[np.ndarray, "draw coefficient"]
    ) -> Float[np.ndarray, "draw coefficient"]:
        """Give draws, alike on both sides of the fitted values.

        Each part counts with its mean on either side. Intervals about the fitted values hold as much either
        way, and no interval by draws leaves out the value that it belongs to.

        Args:
            uniform: even numbers between 0 and 1, which choose the parts and the side.
            normal: independent standard normal ones.

        Returns:
            The draws.
        """
        first = np.concatenate([[0.0], np.cumsum(self.weights)[:-1]])
        chosen = np.searchsorted(first[1:], uniform)
        side = np.where(uniform - first[chosen] < 0.5 * self.weights[chosen], 1.0, -1.0)
        values, vectors = np.linalg.eigh(self.covariances)
        roots = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
        return side[:, None] * self.means[chosen] + np.einsum("dij,dj->di", roots[chosen], normal)

    def to_dict(self) -> dict[str, Any]:
        """Give it as lists of numbers."""
        return {name: values.tolist() for name, values in self._asdict().items()}

    def _headline(self) -> str:
        return f"{len(self.weights)} normal laws of {self.means.shape[1]} coefficients"

    def _rows(self) -> list[Row]:
        return [
            Row(f"[{place}]", f"{100.0 * weight:.3g} %", "of the weight")
            for place, weight in enumerate(self.weights)
        ]


def half_width(
    weights: Float[np.ndarray, "... part"],
    centres: Float[np.ndarray, "... part"],
    deviations: Float[np.ndarray, "... part"],
    confidence: float | Float[np.ndarray, "..."],
) -> Float[np.ndarray, "..."]:
    """Give the half-width about zero that holds some share of each mixture of normal laws, by bisection.

    Args:
        weights: of the parts.
        centres: their means.
        deviations: their standard deviations.
        confidence: the share.

    Returns:
        The half-widths.
    """
    reach = -ndtri(0.5 - 0.5 * np.asarray(confidence, dtype=float))
    high = np.max(np.abs(centres) + (reach[..., None] + 1.0) * deviations, axis=-1)
    low = np.zeros_like(high)
    safe = np.where(deviations > 0.0, deviations, 1e-300)
    for _ in range(_WIDTH_BISECTIONS):
        middle = 0.5 * (low + high)
        held = ndtr((middle[..., None] - centres) / safe) - ndtr((-middle[..., None] - centres) / safe)
        short = np.sum(weights * held, axis=-1) < confidence
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    return high
