"""Nuisances taken out of the normal equations, segment by segment and record by record.

Every coefficient of interest sees only the residual of the data once the initial states of the segments and
the stiffness scales of the records have explained what they can: variable projection, done on the small
matrices of `information`.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ..._show import shown
from ..jacobian import STIFFNESS_SCALE_UNIT
from ._covariance import SMALLEST_EIGENVALUE

_FAST = 1e12
"""Factor on what is known of a state that stays where it is."""


@shown
class Spread(NamedTuple):
    """Standard deviations of the linear stiffness, which are the priors of its deviations.

    Attributes:
        records: from record to record [relative stiffness].
        segments: from segment to segment within a record [relative stiffness]; 0 where it has none.
    """

    records: float
    segments: float = 0.0


@shown
class Nuisances(NamedTuple):
    """Where the nuisances stand, and their priors.

    Attributes:
        states: deviation of each segment's initial states from the measured ones, in the states' own scales
            (which are also the standard deviations of their priors).
        stiffness: deviation of each record's linear stiffness [units of `STIFFNESS_SCALE_UNIT`].
        segments: further deviation of each segment's [the same units].
        spread: standard deviations of the priors of both.
        held: segments whose initial states stay where they stand, as if they were known: where the motion is
            split at kinks linear steps of them may be of no use. None: nowhere.
    """

    states: Float[np.ndarray, "lanes state"]
    stiffness: Float[np.ndarray, " record"]
    segments: Float[np.ndarray, " lanes"]
    spread: Spread
    held: Bool[np.ndarray, " lanes"] | None = None

    def afresh(self) -> "Nuisances":
        """Give what is known of the records alone: other segments or states are to be found anew."""
        return self._replace(states=np.zeros((0, 0)), segments=np.zeros(0), held=None)

    def held_fast(self) -> "Nuisances":
        """Give the same with all initial states where they stand: chi2 is then smooth beside kinks."""
        return self._replace(held=np.full(self.segments.size, True))

    def factor(self, owner: Int[np.ndarray, " lanes"]) -> Float[np.ndarray, " lanes"]:
        """Give the factor on the linear stiffness of each lane.

        Args:
            owner: record of each lane.

        Returns:
            Factors, 1 where nothing deviates.
        """
        return 1.0 + STIFFNESS_SCALE_UNIT * (self.stiffness[owner] + self.segments)


@shown
class Reduced(NamedTuple):
    """Normal equations of the coefficients alone, and the way back to the nuisances.

    Attributes:
        by_record: [[J'J, J'r], [r'J, r'r]] after the nuisances; coefficients first, residual last; whitened.
        eliminated: degrees of freedom that the nuisances of each record took from the data.
        raw: squared size of each coefficient column after the initial states alone; whitened. What they take
            is nothing that a column shows: next to a fold a dwell moves a hundred times as much by its start
            as by any coefficient.
        stiffness_map: step of the stiffness scales = map[:, -1] - map[:, :-1] @ step of the coefficients.
        stiffness_variance: of each record's stiffness scale, given the coefficients [relative stiffness
            squared].
        states_map: step of the states = map[..., -1] - map[..., :-1] @ [step of coefficients, of the
            stiffness scale].
        segments_map: the same of the segments' own stiffness; no rows where it does not scatter.
        segments_variance: of each, given all else [relative stiffness squared].
        by_segment: [[J'J, J'r], [r'J, r'r]] of each segment after its states alone, in the columns of
            `eliminate`; before the residual its own stiffness scale, where the model has one [units of
            `STIFFNESS_SCALE_UNIT`], without its prior.
        misfits: squared residual of each segment where its states stand, with their prior unless the first
            samples alone set them; whitened.
    """

    by_record: Float[np.ndarray, "record column column"]
    eliminated: Float[np.ndarray, " record"]
    raw: Float[np.ndarray, " column"]
    stiffness_map: Float[np.ndarray, "record column"]
    stiffness_variance: Float[np.ndarray, " record"]
    states_map: Float[np.ndarray, "lanes state column2"]
    segments_map: Float[np.ndarray, "segment column3"]
    segments_variance: Float[np.ndarray, " segment"]
    by_segment: Float[np.ndarray, "lanes column4 column4"]
    misfits: Float[np.ndarray, " lanes"]

    @property
    def matrix(self) -> Float[np.ndarray, "column column"]:
        """Normal equations of all records together."""
        return self.by_record.sum(axis=0)

    def of_record(self, record: int) -> "Reduced":
        """Give the equations of one record.

        Args:
            record: its place.

        Returns:
            Equations of the coefficients and of the record's stiffness scale; those of states and segments
            stay as they are.
        """
        own = slice(record, record + 1)
        return self._replace(
            by_record=self.by_record[own],
            eliminated=self.eliminated[own],
            stiffness_map=self.stiffness_map[own],
            stiffness_variance=self.stiffness_variance[own],
        )

    def rescaled(self, sizes: Float[np.ndarray, " kept"]) -> "Reduced":
        """Give the equations of the first coefficients in other units; maps of states stay as they are.

        Args:
            sizes: present unit of each, in the new one.

        Returns:
            The equations.
        """
        keep = np.r_[0 : sizes.size, self.raw.size]
        unit = np.append(1.0 / sizes, 1.0)
        by_record = self.by_record[:, keep[:, None], keep] * np.outer(unit, unit)
        return self._replace(
            by_record=by_record,
            raw=self.raw[: sizes.size] * unit[:-1] ** 2,
            stiffness_map=self.stiffness_map[:, keep] * unit,
        )

    def without(self, columns: Int[np.ndarray, " lost"]) -> "Reduced":
        """Give the equations with nothing in some columns, as if they moved no reading.

        Args:
            columns: coefficients, or the residual behind them.

        Returns:
            The equations.
        """
        by_record, raw = self.by_record.copy(), self.raw.copy()
        states, stiffness = self.states_map.copy(), self.stiffness_map.copy()
        segments = self.segments_map.copy()
        residual = raw.size
        by_record[:, columns], by_record[:, :, columns] = 0.0, 0.0
        stiffness[:, columns] = 0.0
        # In the other maps the stiffness scale may stand between the coefficients and the residual.
        states[..., np.where(columns == residual, -1, columns)] = 0.0
        segments[:, np.where(columns == residual, -1, columns)] = 0.0
        raw[columns[columns < residual]] = 0.0
        return self._replace(
            by_record=by_record, raw=raw, stiffness_map=stiffness, states_map=states, segments_map=segments
        )


def eliminate(
    matrices: Float[np.ndarray, "segment column column"],
    noise: Sequence[float],
    owner: Int[np.ndarray, " segment"],
    columns: int,
    nuisances: Nuisances,
    heads: Float[np.ndarray, "segment column column"] | None = None,
) -> Reduced:
    """Eliminate the initial states of each segment, then its own stiffness and that of its record.

    Where `heads` is given, the initial states follow from the first samples of the records alone, as those of
    a free run do; the rest of a record then has no say in its own start.

    Args:
        matrices: from `information`: coefficients, the stiffness scale where the model has one, initial
            states, residual.
        noise: rms of the noise of each record [SI unit of the output].
        owner: record of each segment.
        columns: count of coefficient columns.
        nuisances: where they stand, and their priors; lanes beyond the segments are padding.
        heads: the same matrices over the first samples of each segment only.

    Returns:
        The reduced equations.
    """
    power = np.array([own**2 for own in noise])[owner, None, None]
    matrices = matrices / power
    heads = None if heads is None else heads / power
    offset, spread = nuisances.states[: owner.size], nuisances.spread
    has_scale = matrices.shape[1] > columns + offset.shape[1] + 1
    misfits = matrices[:, -1, -1] + (0.0 if heads is not None else np.sum(offset**2, axis=1))
    held = np.zeros(owner.size, bool) if nuisances.held is None else nuisances.held[: owner.size]
    left, states_map, taken = _without_states(matrices, heads, columns + int(has_scale), offset, held)
    eliminated = np.zeros(nuisances.stiffness.size)
    np.add.at(eliminated, owner, taken)
    sizes, before = (np.diagonal(one, axis1=1, axis2=2).sum(axis=0)[:columns] for one in (left, matrices))
    # What is left of a column that the states take whole is rounding.
    raw = np.maximum(sizes, SMALLEST_EIGENVALUE * before)
    by_segment, segments_map, segments_variance = left, np.zeros((0, left.shape[1])), np.zeros(0)
    if has_scale and spread.segments > 0.0:
        own = nuisances.segments[: owner.size]
        left, segments_map, segments_variance, taken = _without_scale(left, columns, own, spread.segments)
        np.add.at(eliminated, owner, taken)
    by_record = np.zeros((eliminated.size, *left.shape[1:]))
    np.add.at(by_record, owner, left)
    stiffness_map, variance = np.zeros((eliminated.size, columns + 1)), np.zeros(eliminated.size)
    if has_scale:
        by_record, whole, variance, taken = _without_scale(
            by_record, columns, nuisances.stiffness, spread.records
        )
        by_record = np.delete(np.delete(by_record, columns, axis=1), columns, axis=2)
        stiffness_map = np.delete(whole, columns, axis=1)
        eliminated += taken
    return Reduced(
        by_record,
        eliminated,
        raw,
        stiffness_map,
        variance,
        states_map,
        segments_map,
        segments_variance,
        by_segment,
        misfits,
    )


def _without_states(
    matrices: Float[np.ndarray, "segment column column"],
    heads: Float[np.ndarray, "segment column column"] | None,
    shared: int,
    offset: Float[np.ndarray, "segment state"],
    held: Bool[np.ndarray, " segment"],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Give the matrices without the initial states, the map of their steps, and the freedom they took."""
    segments, states = offset.shape
    keep = np.r_[0:shared, shared + states]
    drop = np.arange(shared, shared + states)
    # A prior is one more measurement: deviation 0 +- 1 in the states' scales.
    source = matrices if heads is None else heads
    inner = source[:, drop[:, None], drop] + np.eye(states)
    cross = source[:, drop[:, None], keep].copy()
    cross[:, :, -1] -= offset
    still = inner.copy()
    still[:, range(states), range(states)] *= np.where(held, _FAST, 1.0)[:, None]
    try:
        states_map = np.linalg.solve(still, cross)
        taken = states - np.trace(np.linalg.inv(inner), axis1=1, axis2=2)
    except np.linalg.LinAlgError:
        # Only a simulation that diverged makes a state's column as large as to drown its own prior.
        states_map, taken = np.full_like(cross, np.nan), np.full(segments, np.nan)
    left = matrices[:, keep[:, None], keep].copy()
    if heads is None:
        left[:, -1, -1] += np.sum(offset**2, axis=1)
        left -= np.swapaxes(cross, 1, 2) @ states_map
    else:
        mixed = np.swapaxes(matrices[:, drop[:, None], keep], 1, 2) @ states_map
        curved = np.swapaxes(states_map, 1, 2) @ matrices[:, drop[:, None], drop] @ states_map
        left += curved - mixed - np.swapaxes(mixed, 1, 2)
    return left, states_map, taken


def _without_scale(
    matrices: Float[np.ndarray, "lane column column"],
    column: int,
    deviation: Float[np.ndarray, " lane"],
    spread: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Give the matrices without a stiffness scale, its step, its variance, and the freedom it took."""
    spread = spread / STIFFNESS_SCALE_UNIT
    pivot = matrices[:, column, column] + 1.0 / spread**2
    row = matrices[:, column, :].copy()
    row[:, -1] -= deviation / spread**2
    step = row / pivot[:, None]
    left = matrices.copy()
    left[:, -1, -1] += (deviation / spread) ** 2
    # Where a simulation diverged the values do not matter, only that they are detected.
    with np.errstate(over="ignore", invalid="ignore"):
        left -= step[:, :, None] * row[:, None, :]
    return left, step, STIFFNESS_SCALE_UNIT**2 / pivot, 1.0 - 1.0 / (pivot * spread**2)


def step_nuisances(
    reduced: Reduced,
    owner: Int[np.ndarray, " lanes"],
    nuisances: Nuisances,
    step: Float[np.ndarray, " column"],
) -> Nuisances:
    """Give the nuisances that go with a step of the coefficients.

    Args:
        reduced: the equations at the present point.
        owner: record of each lane.
        nuisances: where they stand.
        step: step of the coefficients, in the units of their columns.

    Returns:
        The nuisances after the step.
    """
    stiffness_step = reduced.stiffness_map[:, -1] - reduced.stiffness_map[:, :-1] @ step
    used = reduced.states_map.shape[0]
    factor_step = stiffness_step[owner[:used]]
    segments = nuisances.segments.copy()
    if reduced.segments_map.shape[0]:
        own = reduced.segments_map
        segments_step = own[:, -1] - own[:, : step.size] @ step - own[:, step.size] * factor_step
        segments[:used] += segments_step
        factor_step = factor_step + segments_step
    coefficients = reduced.states_map[:, :, : step.size] @ step
    if reduced.states_map.shape[2] == step.size + 2:
        coefficients = coefficients + reduced.states_map[:, :, step.size] * factor_step[:, None]
    states = nuisances.states.copy()
    states[:used] += reduced.states_map[:, :, -1] - coefficients
    return nuisances._replace(
        states=states, stiffness=nuisances.stiffness + stiffness_step, segments=segments
    )


def promised_misfits(
    reduced: Reduced,
    owner: Int[np.ndarray, " lanes"],
    nuisances: Nuisances,
    moved: Nuisances,
    step: Float[np.ndarray, " column"],
) -> Float[np.ndarray, " segment"]:
    """Give what a step was to leave of the squared residual of each segment.

    Args:
        reduced: the equations before the step.
        owner: record of each lane.
        nuisances: where they stood.
        moved: where they stand after it, by `step_nuisances`.
        step: step of the coefficients, in the units of their columns.

    Returns:
        Squared residuals with the prior of the states; whitened.
    """
    used = reduced.misfits.size
    scales = (moved.stiffness - nuisances.stiffness)[owner] + moved.segments - nuisances.segments
    along = np.ones((used, reduced.by_segment.shape[1]))
    along[:, : step.size] = -step
    if along.shape[1] == step.size + 2:
        along[:, step.size] = -scales[:used]
    return np.einsum("lc,lcd,ld->l", along, reduced.by_segment, along)
