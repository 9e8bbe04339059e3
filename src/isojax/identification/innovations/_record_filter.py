"""A model's filter over the records of a campaign: many points at once, side by side."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._parameters import ParameterSpec, list_parameters
from ..._types import on_device
from ...models import Isolator, State
from ..jacobian import FIRST_STATES, Batch, workers
from ._filter import Followed, Lanes, Trace, follow_records, innovation_products
from ._measured import Measured

SPACING = 0.05
"""Difference of the logarithm of a size over which the likelihood is differentiated."""

COPIES = 7
"""Points at which a filter runs side by side: one, and six with other sizes."""

_FINER = (1.0, 0.3, 0.1)
"""Spacing of the first states that are tried in turn, over that of `FIRST_STATES`."""

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
        step = np.clip(np.log(np.maximum(1.0 + step, np.exp(-furthest))), -furthest, furthest)
        moved = here + step
        return Sizes(float(moved[0]), float(moved[1]), moved[2:]).within(bounds)

    def within(self, bounds: tuple["Sizes", "Sizes"]) -> "Sizes":
        """Give the sizes that lie nearest, between the smallest and the largest."""
        force, memory, noise = (np.clip(*each) for each in zip(self, *bounds, strict=True))
        return Sizes(float(force), float(memory), noise)

    @property
    def correlation(self) -> float:
        """Correlation of the random force from sample to sample."""
        return float(np.exp(-np.exp(-self.memory)))

    @property
    def variance(self) -> float:
        """Variance of the random force [squared SI unit of the drive]."""
        return float(np.exp(self.force) / (1.0 - self.correlation**2))


def physical(
    free: Float[np.ndarray, " column"], specs: tuple[ParameterSpec, ...], scales: tuple[float, ...]
) -> tuple[Float[np.ndarray, " column"], Float[np.ndarray, " column"]]:
    """Give the physical numbers of unbounded variables, and their slopes: `to_physical`, by NumPy.

    Args:
        free: the unbounded variables.
        specs: declarations with the bounds.
        scales: magnitudes of the numbers.

    Returns:
        Both.
    """
    numbers, slopes = np.empty(len(specs)), np.empty(len(specs))
    for place, (value, spec, scale) in enumerate(zip(free, specs, scales, strict=True)):
        low, high = np.isfinite(spec.lower), np.isfinite(spec.upper)
        rising = np.exp(-np.logaddexp(0.0, -value))
        if low and high:
            numbers[place] = spec.lower + (spec.upper - spec.lower) * rising
            slopes[place] = (spec.upper - spec.lower) * rising * (1.0 - rising)
        elif low or high:
            sign = 1.0 if low else -1.0
            numbers[place] = (spec.lower if low else spec.upper) + sign * scale * np.logaddexp(0.0, value)
            slopes[place] = sign * scale * rising
        else:
            numbers[place], slopes[place] = scale * value, scale
    return numbers, slopes


class RecordFilter:
    """The filter of one model structure over records, each a lane from its first sample to its last."""

    def __init__(self, model: Isolator, measured: Measured, steps: int):
        """Keep what does not change; nothing is computed yet.

        Args:
            model: the isolator; where its parameters are not given they stay.
            measured: the records.
            steps: integration steps a sample, at least.
        """
        self.model, self.measured, self.tables = model, measured, measured.tables(steps)
        self.prepared = prepared = self.tables.prepared(model, len(model.elements))
        self.count = len(prepared.segments)
        states = 2 + model.internal_states
        self.starts, self.spread = np.zeros((states, self.count)), np.zeros((states, self.count))
        self.starts[:2] = prepared.starts[:, : self.count]
        self.spread[:2] = prepared.spread[:, : self.count] ** 2
        self._tabled = (
            on_device(np.asarray(model.shift(), dtype=float)),
            on_device(np.asarray(model.skew(), dtype=float)),
        )
        self._numbers = [np.asarray(entry.value, dtype=float) for entry in list_parameters(model)]
        self._copied: dict[tuple[int, int], Batch] = {}

    @property
    def feeds_through(self) -> bool:
        """Whether the random force acts straight on the reading, where a white one has no finite variance."""
        return self.measured.quantity == "acceleration" and self.model.excitation == "force"

    @property
    def samples(self) -> float:
        """Samples that count."""
        return float(sum(np.asarray(batch.weight).sum() for batch in self.prepared.batches))

    @property
    def steps(self) -> int:
        """Integration steps a sample."""
        return (self.prepared.batches[0].drive.shape[1] - 1) // 2

    def with_steps(self, steps: int, model: Isolator) -> "RecordFilter":
        """Give the same filter with other steps a sample; the first states are those that it has.

        Args:
            steps: integration steps a sample, at least.
            model: the isolator, at other numbers.

        Returns:
            The filter.
        """
        other = RecordFilter(model, self.measured, steps)
        other.starts, other.spread = self.starts.copy(), self.spread.copy()
        return other

    def follow(
        self,
        places: tuple[int, ...],
        points: Float[np.ndarray, "copy column"],
        sizes: Sequence[Sizes],
        starts: Float[np.ndarray, "copy state record"] | None = None,
    ) -> "Way":
        """Filter every record at several points.

        Args:
            places: parameters that are given.
            points: their values, `COPIES` of them.
            sizes: of the errors at each point: those of `around`, where slopes with them are wanted.
            starts: means of the first states at each point; those of the filter if omitted.

        Returns:
            The deviance at each, and the way at the first.
        """
        copies = len(points)
        variances = np.array([one.variance for one in sizes])

        def one(part: int) -> Followed:
            known, width = self._known(part)
            repeated = on_device(np.repeat(variances, width))
            lanes = Lanes(
                repeated,
                on_device(np.repeat([one.correlation for one in sizes], width)),
                on_device(np.exp([one.noise[known] for one in sizes]).ravel()),
                self._start(part, copies, starts),
                (*(on_device(np.tile(row[known], copies)) for row in self.spread), repeated),
            )
            sampling, values = self.prepared.sampling, self._values(part, places, points)
            batch = self._batch(part, copies)
            return follow_records(
                self.model,
                values,
                lanes,
                batch,
                sampling.quantity,
                sampling.time,
                self._tabled,
                width,
                SPACING,
            )

        found = self._in_parts(one)
        deviance = self._by_record([each.deviance for each in found], copies)
        squares = [
            self._by_record([each.square[row] for each in found], copies)[0]
            for row in range(2, len(found[0].square) - 1)
        ]
        return Way(
            np.where(np.isfinite(deviance), deviance, np.inf),
            np.array(squares).reshape(-1, self.count),
            self._by_record([each.slope for each in found], 1)[:, 0],
            self._by_record([each.fisher for each in found], 1)[:, :, 0],
            sizes[0].correlation,
            [each.trace for each in found],
        )

    def products(
        self, places: tuple[int, ...], points: Float[np.ndarray, "copy column"], way: "Way", columns: bool
    ) -> Float[np.ndarray, "row row copy record"]:
        """Give the products of innovations at several points, with the gains of a way held.

        Args:
            places: parameters that are given.
            points: their values.
            way: whose gains and deviations count.
            columns: whether the innovations are differentiated with the parameters.

        Returns:
            `A^T A`, see `innovation_products`; not finite where a motion diverged.
        """
        copies, unit = len(points), np.eye(len(places))
        directions = tuple(
            on_device(unit[places.index(place)] if columns and place in places else np.zeros(0))
            for place in range(len(self._numbers))
        )

        def one(part: int) -> Array:
            trace = way.traces[part]
            if copies > 1:
                trace = jax.tree.map(lambda own: jnp.tile(own, copies), trace)
            sampling, values = self.prepared.sampling, self._values(part, places, points)
            batch, memory = self._batch(part, copies), jnp.asarray(way.correlation)
            return innovation_products(
                self.model,
                values,
                directions,
                self._start(part, copies),
                memory,
                trace,
                batch,
                sampling.quantity,
                sampling.time,
                self._tabled,
            )

        return self._by_record(self._in_parts(one), copies)

    def _in_parts(self, work: Callable[[int], Any]) -> list[Any]:
        """Work on each batch in a thread of its own."""
        with ThreadPoolExecutor(workers()) as pool:
            return list(
                pool.map(lambda part: jax.block_until_ready(work(part)), range(len(self.prepared.batches)))
            )

    def _known(self, part: int) -> tuple[Int[np.ndarray, " lane"], int]:
        """Give the records of the lanes of a batch; lanes without one repeat the last."""
        width = self.prepared.order.size // len(self.prepared.batches)
        return np.minimum(self.prepared.order[part * width : (part + 1) * width], self.count - 1), width

    def seek_starts(self, places: tuple[int, ...], point: Float[np.ndarray, " column"], sizes: Sizes) -> None:
        """Begin each record at the displacement and velocity, of many, from which it is followed best.

        A filter is linear about its mean. Where the first mean is far off and the motion bends, it never
        finds the records.

        Args:
            places: parameters that are given.
            point: their values.
            sizes: of the errors.
        """
        scale, center = self.prepared.spread[:, : self.count], np.zeros((2, self.count))
        for finer in _FINER:
            tried = np.concatenate([self.starts[None, :2], center + finer * FIRST_STATES[:, :, None] * scale])
            found = np.full((tried.shape[0], self.count), np.inf)
            for first in range(0, tried.shape[0], COPIES):
                part = np.minimum(np.arange(first, first + COPIES), tried.shape[0] - 1)
                starts = np.repeat(self.starts[None], COPIES, axis=0)
                starts[:, :2] = tried[part]
                way = self.follow(places, np.repeat(point[None], COPIES, axis=0), (sizes,) * COPIES, starts)
                found[part] = way.deviance
            best = np.argmin(found, axis=0)
            self.starts[:2] = center = tried[best, :, np.arange(self.count)].T
            self.spread[:2] = (finer * scale) ** 2

    def _start(
        self, part: int, copies: int, starts: Float[np.ndarray, "copy state record"] | None = None
    ) -> State:
        known, width = self._known(part)
        rows = (
            np.tile(self.starts[:, known], copies)
            if starts is None
            else np.concatenate(list(starts[:, :, known]), axis=1)
        )
        return (
            *(on_device(row) for row in rows),
            on_device(np.zeros(copies * width)),
        )

    def _values(
        self, part: int, places: tuple[int, ...], points: Float[np.ndarray, "copy column"]
    ) -> tuple[Array, ...]:
        width, numbers = self._known(part)[1], []
        for place, number in enumerate(self._numbers):
            column = points[:, places.index(place)] if place in places else np.full(len(points), number)
            numbers.append(on_device(np.repeat(column, width)))
        return tuple(numbers)

    def _by_record(self, parts: list[Array], copies: int) -> np.ndarray:
        """Join what the batches gave: the last axis becomes (copy, record)."""
        order, joined = self.prepared.order, []
        for values in map(np.asarray, parts):
            joined.append(values.reshape(*values.shape[:-1], copies, -1))
        whole = np.concatenate(joined, axis=-1)
        return whole[..., np.argsort(order)[: self.count]]

    def _batch(self, part: int, copies: int) -> Batch:
        """Give the records of a batch, as often as there are points."""
        if copies == 1:
            return self.prepared.batches[part].following(self.model)
        if (part, copies) not in self._copied:
            batch = self.prepared.batches[part].following(self.model)
            self._copied[part, copies] = jax.tree.map(
                lambda one: on_device(np.tile(np.asarray(one), copies)) if np.ndim(one) else one, batch
            )
        return self._copied[part, copies]


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
