"""What each record has of its own and follows the coefficients of a model: first states, stiffness, zero."""

import copy
from typing import Self

import numpy as np
from jaxtyping import Bool, Float

from ._first_states import FirstStates, covariance_of, eliminate

_LEAST_SCATTER = 1e-5
"""Least scatter of the linear stiffness from record to record [relative]."""


_KNOWN = 1e-200
"""Variance of what is known."""


class RecordStarts:
    """First states of each record, and after them what else is its own: the relative deviation of its linear
    stiffness where that scatters from record to record, and the zero of its sensor where a mean was removed.

    Attributes:
        starts: means of the first states of each record.
        spread: their variances.
    """

    def __init__(
        self,
        starts: Float[np.ndarray, "state record"],
        spread: Float[np.ndarray, "state record"],
        scatter: float,
        zeros: Float[np.ndarray, " record"],
    ):
        """Keep what is known before the records are seen.

        Args:
            starts: means of the first states.
            spread: their variances.
            scatter: standard deviation of the linear stiffness from record to record [relative]; 0 where all
                records have one.
            zeros: standard deviation of the zero of each record's sensor [SI unit of the output]; 0 where it
                is known.
        """
        self._states, self.count = starts.shape
        self._scatters, self._shifts = scatter > 0.0, bool(np.any(zeros > 0.0))
        own = [np.full(self.count, scatter**2)] * self._scatters
        own += [np.maximum(zeros**2, _KNOWN)] * self._shifts
        more = np.reshape(own, (-1, self.count))
        self.starts, self.spread = np.vstack([starts, 0.0 * more]), np.vstack([spread, more])
        self._centers, self._prior = self.starts.copy(), self.spread.copy()

    @property
    def scatter(self) -> float:
        """Standard deviation of the linear stiffness from record to record [relative]; 0 where it is one."""
        return 0.0 if not self._scatters else float(np.sqrt(self._prior[self._states, 0]))

    @property
    def stiffness(self) -> Float[np.ndarray, " record"]:
        """Factor on the linear stiffness of each record."""
        return np.ones(self.count) if not self._scatters else 1.0 + self.starts[self._states]

    @property
    def zeros(self) -> tuple[Float[np.ndarray, " record"], Float[np.ndarray, " record"]] | None:
        """Zero of each record's sensor, and its variance beforehand [SI unit of the output]; None where all
        are known.
        """
        return (self.starts[-1], self._prior[-1]) if self._shifts else None

    def with_own_starts(self) -> Self:
        """Give the same filter, whose first states may move while those of this one stay."""
        other = copy.copy(self)
        for name in ("starts", "spread", "_centers", "_prior"):
            setattr(other, name, getattr(self, name).copy())
        return other

    def of_coefficients(
        self, products: Float[np.ndarray, "row row record"]
    ) -> tuple[Float[np.ndarray, "kept kept record"], Float[np.ndarray, " record"]]:
        """Leave out the first states, and eliminate what else each record has of its own.

        Args:
            products: of `slopes`.

        Returns:
            `A^T A` of coefficients and innovations; what is unknown of each record adds to the deviance.
        """
        size = len(products) - len(self.starts) - 1
        rows = np.r_[:size, size + self._states : len(products)]
        kept, added = products[np.ix_(rows, rows)].copy(), np.zeros(self.count)
        for place in reversed(range(self._states, len(self.starts))):
            variance, off, row = self._prior[place], self.starts[place], kept[-2].copy()
            row[-1] += off / variance
            known = row[-2] + 1.0 / variance
            added += off**2 / variance + np.log(known * variance)
            kept = np.delete(np.delete(kept - row[:, None] * row[None] / known, -2, 0), -2, 1)
        return kept, added

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
        along = first.along[self._states][:, judged]
        error = np.einsum("cr,cd,dr->r", along, covariance_of(information), along)
        squares = self.starts[self._states, judged] ** 2 + first.spread[self._states, judged] + error
        if np.all(np.isfinite(squares)):
            self._prior[self._states] = max(float(np.mean(squares)), _LEAST_SCATTER**2)

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
        given = np.where(np.arange(len(self.starts))[:, None] < self._states, self.spread, 0.0)
        return eliminate(products, self.starts, self._centers, self._prior, damping, given)

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
