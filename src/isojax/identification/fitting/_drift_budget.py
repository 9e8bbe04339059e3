"""What of an error bar is repeatability: the linear stiffness that is not the same in every record."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..._parameters import list_parameters
from ..._results import is_successful
from ..._show import Row, amount, number, shown
from ..jacobian import STIFFNESS_SCALE_UNIT, has_stiffness_scale
from ._as_fit import Fitted, as_fit
from ._elimination import Reduced, Spread
from ._fit_result import Fit


@shown
class Share(NamedTuple):
    """What limits one coefficient.

    Attributes:
        name: of the coefficient, as in reports.
        unit: its unit.
        value: fitted value.
        standard_error: of the fit; NaN where the data do not determine it.
        noise: the error that noise alone would leave, were the stiffness the same in every record.
        repeatability: what the scatter of the stiffness adds: standard_error^2 = noise^2 + repeatability^2.
        if_ignored: standard deviation of the value that the scatter by itself would put there in a fit that
            held every record for the same isolator.
    """

    name: str
    unit: str
    value: float
    standard_error: float
    noise: float
    repeatability: float
    if_ignored: float

    def _headline(self) -> str:
        return f"{self.name}, {amount(self.value, self.unit, self.standard_error)}"


@shown
class DriftBudget(NamedTuple):
    """How far the scatter of the linear stiffness limits a fit.

    Attributes:
        scatter: standard deviation of the linear stiffness between records [relative]; NaN where the model
            has none, a single record shows none, or the fit failed.
        shares: each fitted coefficient; none where the scatter is not known.
        within: the same between the segments of a record; 0 where no repeat shows one.
    """

    scatter: float
    shares: tuple[Share, ...]
    within: float = 0.0

    def of(self, name: str) -> Share | None:
        """Give the share of one coefficient.

        Args:
            name: as in reports.

        Returns:
            Its share, or None if it was not fitted.
        """
        return next((share for share in self.shares if share.name == name), None)

    def _headline(self) -> str:
        return f"the linear stiffness scatters by {100.0 * self.scatter:.2g} % between records"

    def _rows(self) -> list[Row]:
        return [
            Row(
                one.name,
                amount(one.value, one.unit, one.standard_error),
                f"noise {number(one.noise)}, repeatability {number(one.repeatability)}",
            )
            for one in self.shares
        ]


def drift_budget(fit: Fit | Fitted) -> DriftBudget:
    """Split the error bars of a fit into noise and repeatability.

    The fit holds each record's stiffness scale for one draw of a normal law, whose standard deviation repeats
    have shown, and eliminates it. Undoing that elimination in its equations gives what noise alone would
    leave.

    Args:
        fit: the fit.

    Returns:
        The budget.
    """
    fit = as_fit(fit)
    found = fit.estimate
    single = len(found.problem.records) < 2
    if single or not is_successful(fit.result) or not has_stiffness_scale(fit.model):
        return DriftBudget(float("nan"), ())
    spread = found.point.nuisances.spread
    owner = np.array([segment.record for segment in found.problem.segments])
    noise, if_ignored = noise_and_scatter_errors(found.point.reduced, owner, spread)
    inflation = np.sqrt(found.inflation)
    listed = list_parameters(fit.model)
    errors = fit.standard_errors
    shares = []
    for column, place in enumerate(found.places):
        entry = listed[place]
        whole, part = errors[entry.name], float(inflation * noise[column])
        rest = float(np.sqrt(max(whole**2 - part**2, 0.0)))
        shares.append(
            Share(
                entry.name,
                entry.spec.unit,
                float(entry.value),
                whole,
                min(part, whole) if np.isfinite(whole) else float("nan"),
                rest if np.isfinite(whole) else float("nan"),
                float(if_ignored[column]) if np.isfinite(whole) else float("nan"),
            )
        )
    return DriftBudget(spread.records, tuple(shares), spread.segments)


def noise_and_scatter_errors(
    reduced: Reduced, owner: Int[np.ndarray, " segment"], spread: Spread
) -> tuple[Float[np.ndarray, " column"], Float[np.ndarray, " column"]]:
    """Give the errors that noise alone leaves, and those that the scatter of the stiffness puts in unawares.

    With J_r the whitened columns of a record after its initial states and g_r that of its stiffness scale,
    `A = sum J_r'J_r`: noise alone leaves `A^-1`; a scale off by delta_r moves the unaware estimate by
    `A^-1 J_r'g_r delta_r`. So does the scale of a segment where the stiffness scatters within records.

    Args:
        reduced: the equations, stiffness scales eliminated.
        owner: record of each segment.
        spread: standard deviations of the scales [relative stiffness].

    Returns:
        Standard deviations of the coefficients; NaN where the data determine none of them.
    """
    count = reduced.raw.size
    pivot = STIFFNESS_SCALE_UNIT**2 / reduced.stiffness_variance
    cross = pivot[:, None] * reduced.stiffness_map[:, :-1]
    own_pivot = STIFFNESS_SCALE_UNIT**2 / reduced.segments_variance
    own = reduced.segments_map[:, : count + 1]
    shares = own_pivot[:, None] * own[:, :count]
    # As it was before the segments took their own share of it.
    np.add.at(cross, owner[: own.shape[0]], shares * own[:, count:])
    undone = np.einsum("r,ri,rj->ij", pivot, reduced.stiffness_map[:, :-1], reduced.stiffness_map[:, :-1])
    undone += shares.T @ own[:, :count]
    whole = reduced.matrix[:-1, :-1] + undone
    # Stiffness in N/m and in N/m^3 must not spoil each other.
    size = np.sqrt(np.maximum(np.diag(whole), 0.0))
    size = np.where(size > 0.0, size, 1.0)
    try:
        inverse = np.linalg.inv(whole / np.outer(size, size)) / np.outer(size, size)
    except np.linalg.LinAlgError:
        unknown = np.full(size.size, np.nan)
        return unknown, unknown
    scatter = np.concatenate([cross * spread.records, shares * spread.segments])
    moved = inverse @ scatter.T / STIFFNESS_SCALE_UNIT
    return np.sqrt(np.maximum(np.diag(inverse), 0.0)), np.sqrt(np.sum(moved**2, axis=1))
