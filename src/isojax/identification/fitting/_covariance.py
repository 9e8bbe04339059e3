"""Uncertainty of fitted coefficients, in physical units: where information turns into error bars.

What the error bars hold: the noise of the output, by its density inside its band; the initial states; the
scatter of the linear stiffness from record to record, so that the mean over n records is uncertain by
scatter/sqrt(n) too; and that n records show this scatter only so well, see `_scatter_mixture`.

What they do not hold, and what can exceed them once the noise is small:

- the calibration of the channels. A gain 1 + s that both share leaves every linear coefficient as it is and
  nothing in the residual, but moves the coefficient of a force of degree n by -(n - 1) s: a filter with the
  gain 1.00015 shifts a cubic spring by -0.03 %. A gain of one channel moves every coefficient by about s, the
  mass being declared. No record shows either; error bars would have to be declared with the gains.
- noise of the force. Through the isolator it becomes motion; at 0.02 N on 800 kg (1 kHz) its density is below
  a thousandth of that of 0.003 m/s^2 of sensor noise, and it is left out. A force as noisy as the response
  would bias the coefficients.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from ..._show import shown
from ...models import NormalMixture

SMALLEST_EIGENVALUE = 1e-11
"""Relative eigenvalue of the scaled information below which a combination counts as undetermined, and share
of a column below which what an elimination leaves of it is rounding.

Products are accumulated in float64, so that shares of about 1e-13 are rounding; a hundred times that is the
margin.
"""

PARTNER = 0.1
"""Share from which a coefficient takes part in a combination that the records do not determine."""


@shown
class Uncertainty(NamedTuple):
    """Error bars.

    Attributes:
        covariance: of the coefficients [product of their units]; NaN in rows that the data do not determine.
        standard_error: square root of its diagonal.
        correlation: covariance scaled to a unit diagonal.
        determined: False where a coefficient belongs to a combination that the data do not determine.
        partners: for each undetermined combination, the places of the coefficients in it.
        mixture: law of the coefficients' deviations where its tails are longer than normal ones; None where
            they are normal.
    """

    covariance: Float[np.ndarray, "column column"]
    standard_error: Float[np.ndarray, " column"]
    correlation: Float[np.ndarray, "column column"]
    determined: Bool[np.ndarray, " column"]
    partners: tuple[tuple[int, ...], ...]
    mixture: NormalMixture | None = None


def invert_information(matrix: Float[np.ndarray, "column column"], inflation: float = 1.0) -> Uncertainty:
    """Invert an information matrix.

    `C = inflation (J'J)^-1` with J the whitened derivatives after the nuisances. The matrix is first scaled
    to a unit diagonal, so that stiffness in N/m and in N/m^3 do not spoil each other.

    Args:
        matrix: J'J [inverse product of units], coefficients only.
        inflation: factor on the covariance: max(1, chi2/dof) where the model does not explain all of the
            data.

    Returns:
        The uncertainty; all NaN and nothing determined where the matrix is not finite.

    Source: Seber & Wild 1989, Nonlinear Regression, eq. (2.21).
    """
    if not np.all(np.isfinite(matrix)):
        return unknown(matrix.shape[0])
    known = find_determined(matrix)
    return known.uncertainty(inflation * (known.vectors / known.values) @ known.vectors.T)


@shown
class Determined(NamedTuple):
    """What an information matrix determines, its columns scaled to a unit diagonal.

    Attributes:
        size: of each column; one where the data hold no trace of it.
        values: information along each determined direction.
        vectors: these directions.
        columns: False where a coefficient belongs to a combination that is not determined.
        partners: for each such combination, the places of the coefficients in it.
    """

    size: Float[np.ndarray, " column"]
    values: Float[np.ndarray, " direction"]
    vectors: Float[np.ndarray, "column direction"]
    columns: Bool[np.ndarray, " column"]
    partners: tuple[tuple[int, ...], ...]

    def uncertainty(self, covariance: Float[np.ndarray, "column column"]) -> Uncertainty:
        """Give the uncertainty in physical units.

        Args:
            covariance: of the scaled columns.

        Returns:
            It, with NaN for what is not determined.
        """
        covariance = covariance / np.outer(self.size, self.size)
        covariance[~self.columns, :] = np.nan
        covariance[:, ~self.columns] = np.nan
        error = np.sqrt(np.diag(covariance))
        return Uncertainty(
            covariance, error, covariance / np.outer(error, error), self.columns, self.partners
        )


def find_determined(matrix: Float[np.ndarray, "column column"]) -> Determined:
    """Separate what an information matrix determines from what it does not.

    Args:
        matrix: finite [inverse product of units].

    Returns:
        Directions of either kind.
    """
    count = matrix.shape[0]
    size = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    dead = ~(size > 0.0)
    safe = np.where(dead, 1.0, size)
    scaled = matrix / np.outer(safe, safe)
    values, vectors = np.linalg.eigh(scaled) if count else (np.zeros(0), np.zeros((0, 0)))
    good = values > SMALLEST_EIGENVALUE * max(1.0, count)
    partners = tuple(
        tuple(int(place) for place in np.flatnonzero(np.abs(vectors[:, index]) > PARTNER))
        for index in np.flatnonzero(~good)
    )
    determined = ~dead
    for group in partners:
        determined[list(group)] = False
    return Determined(safe, values[good], vectors[:, good], determined, partners)


def unknown(count: int) -> Uncertainty:
    """Give what is known after a search that failed: nothing."""
    nothing = np.full((count, count), np.nan)
    return Uncertainty(nothing, np.full(count, np.nan), nothing, np.zeros(count, dtype=bool), ())
