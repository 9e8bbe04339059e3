"""The first states of records, and their linear stiffness, which follow the coefficients of a model."""

import copy
from typing import Self

import numpy as np
from jaxtyping import Bool, Float

from ._first_states import FirstStates, covariance_of, eliminate

_LEAST_SCATTER = 1e-5
"""Least scatter of the linear stiffness from record to record [relative]."""


class RecordStarts:
    """First states of each record. Where the linear stiffness scatters from record to record, its relative
    deviation is a last row of them.

    Attributes:
        starts: means of the first states of each record.
        spread: their variances.
    """

    def __init__(
        self,
        starts: Float[np.ndarray, "state record"],
        spread: Float[np.ndarray, "state record"],
        scatter: float,
    ):
        """Keep what is known before the records are seen.

        Args:
            starts: means of the first states.
            spread: their variances.
            scatter: standard deviation of the linear stiffness from record to record [relative]; 0 where all
                records have one.
        """
        self._states, self.count = starts.shape
        more = np.zeros((int(scatter > 0.0), self.count))
        self.starts, self.spread = np.vstack([starts, more]), np.vstack([spread, more + scatter**2])
        self._centers, self._prior = self.starts.copy(), self.spread.copy()

    @property
    def _scatters(self) -> bool:
        return len(self.starts) > self._states

    @property
    def scatter(self) -> float:
        """Standard deviation of the linear stiffness from record to record [relative]; 0 where it is one."""
        return 0.0 if not self._scatters else float(np.sqrt(self._prior[-1, 0]))

    @property
    def stiffness(self) -> Float[np.ndarray, " record"]:
        """Factor on the linear stiffness of each record."""
        return np.ones(self.count) if not self._scatters else 1.0 + self.starts[-1]

    def with_own_starts(self) -> Self:
        """Give the same filter, whose first states may move while those of this one stay."""
        other = copy.copy(self)
        for name in ("starts", "spread", "_centers", "_prior"):
            setattr(other, name, getattr(self, name).copy())
        return other

    def of_coefficients(
        self, products: Float[np.ndarray, "row row record"]
    ) -> tuple[Float[np.ndarray, "kept kept record"], Float[np.ndarray, " record"]]:
        """Leave out the first states, and eliminate the stiffness of each record.

        Args:
            products: of `slopes`.

        Returns:
            `A^T A` of coefficients and innovations; what the unknown stiffness adds to the deviance.
        """
        size = len(products) - len(self.starts) - 1
        rows = np.r_[:size, len(products) - 1]
        kept = products[np.ix_(rows, rows)]
        if not self._scatters:
            return kept, np.zeros(self.count)
        row, variance, off = products[-2][rows], self._prior[-1], self.starts[-1]
        row[-1] += off / variance
        known = products[-2, -2] + 1.0 / variance
        added = off**2 / variance + np.log(known * variance)
        return kept - row[:, None] * row[None] / known, added

    def scatter_as(self, first: FirstStates, judged: Bool[np.ndarray, " record"]) -> None:
        """Let the stiffness scatter as that of the records does: a step of expectation and maximisation.

        Args:
            first: of `eliminate`, at the coefficients.
            judged: the records that are fitted.

        Source: Dempster, Laird & Rubin 1977, J. R. Stat. Soc. B 39:1; with the coefficients' own error, by
        restricted likelihood.
        """
        if not self._scatters:
            return
        information = first.reduced[:-1, :-1, judged].sum(axis=-1)
        along = first.along[-1][:, judged]
        error = np.einsum("cr,cd,dr->r", along, covariance_of(information), along)
        squares = self.starts[-1, judged] ** 2 + first.spread[-1, judged] + error
        if np.all(np.isfinite(squares)):
            self._prior[-1] = max(float(np.mean(squares)), _LEAST_SCATTER**2)

    def widen(self, squares: Float[np.ndarray, "internal record"]) -> None:
        """Let the internal states begin anywhere in the range that they visit.

        Args:
            squares: mean square of each.
        """
        inner = slice(2, self._states)
        self.spread[inner] = self._prior[inner] = np.where(np.isfinite(squares), squares, 0.0)

    def eliminate(
        self, products: Float[np.ndarray, "row row record"], damping: Float[np.ndarray, " record"]
    ) -> FirstStates:
        """Give how the first states of each record follow the coefficients.

        A filter corrects its start by the first samples. Where its spread was too small, or a law jumps, that
        does not do: the position at which dry friction holds a mass shows much later.

        Args:
            products: of `slopes`.
            damping: Marquardt's, of the first states of each record.

        Returns:
            The steps of Gauss and Newton.
        """
        return eliminate(products, self.starts, self._centers, self._prior, damping)

    def penalties(self, starts: Float[np.ndarray, "copy state record"]) -> Float[np.ndarray, "copy record"]:
        """Give what first states cost that lie off their centres."""
        return np.sum((starts - self._centers) ** 2 / np.maximum(self._prior, 1e-300), axis=1)

    def begin(
        self,
        starts: Float[np.ndarray, "state record"],
        spread: Float[np.ndarray, "state record"],
        where: Bool[np.ndarray, " record"],
    ) -> None:
        """Begin some records elsewhere.

        Args:
            starts: means of the first states.
            spread: their variances.
            where: the records.
        """
        self.starts, self.spread = np.where(where, starts, self.starts), np.where(where, spread, self.spread)
