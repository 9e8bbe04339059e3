"""A model's filter over the records of a campaign: many points at once, side by side."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._parameters import list_parameters
from ..._types import on_device
from ...models import Isolator, State
from ..jacobian import FIRST_STATES, Batch, stiffness_place, with_zero, workers
from ._filter import Followed, Lanes, follow_records, innovation_products
from ._measured import Measured
from ._record_starts import RecordStarts
from ._sizes import SPACING, Sizes, Way

COPIES = 7
"""Points at which a filter runs side by side: one, and six with other sizes."""

_FINER = (1.0, 0.3, 0.1)
"""Spacing of the first states that are tried in turn, over that of `FIRST_STATES`."""


class RecordFilter(RecordStarts):
    """The filter of one model structure over records, each a lane from its first sample to its last.

    Attributes:
        starts: means of the first states of each record.
        spread: their variances.
        followed: the model, and the zero error of its sensor where that differs from record to record.
    """

    def __init__(self, model: Isolator, measured: Measured, steps: int):
        """Keep what does not change; nothing is computed yet.

        Args:
            model: the isolator; where its parameters are not given they stay.
            measured: the records.
            steps: integration steps a sample, at least.
        """
        self.model, self.measured, self.tables = model, measured, measured.tables(steps)
        shifts = bool(np.any(measured.zeros > 0.0))
        self.followed, self._zero = with_zero(model) if shifts else (model, None)
        self.prepared = prepared = self.tables.prepared(self.followed, len(self.followed.elements))
        self._stiffness = stiffness_place(model) if measured.scatter > 0.0 else None
        lanes = len(prepared.segments)
        starts, spread = np.zeros((2, 2 + model.internal_states, lanes))
        starts[:2], spread[:2] = prepared.starts[:, :lanes], prepared.spread[:, :lanes] ** 2
        scatter = 0.0 if self._stiffness is None else measured.scatter
        super().__init__(starts, spread, scatter, measured.zeros)
        self._tabled = (
            on_device(np.asarray(model.shift(), dtype=float)),
            on_device(np.asarray(model.skew(), dtype=float)),
        )
        # An array, so that records of other rates share compiled code.
        self._time = on_device(np.asarray(prepared.sampling.time))
        self._numbers = [np.asarray(entry.value, dtype=float) for entry in list_parameters(self.followed)]
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
        other._centers, other._prior = self._centers.copy(), self._prior.copy()
        return other

    def follow(
        self,
        places: tuple[int, ...],
        points: Float[np.ndarray, "copy column"],
        sizes: Sequence[Sizes],
        starts: Float[np.ndarray, "copy state record"] | None = None,
    ) -> Way:
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
                (
                    *(on_device(np.tile(row[known], copies)) for row in self.spread[: self._states]),
                    repeated,
                ),
            )
            sampling, values = self.prepared.sampling, self._values(part, places, points, starts)
            batch = self._batch(part, copies)
            return follow_records(
                self.followed,
                values,
                lanes,
                batch,
                sampling.quantity,
                self._time,
                self._tabled,
                width,
                SPACING,
            )

        found = self._in_parts(one)
        deviance = self.by_record([each.deviance for each in found], copies)
        squares = [
            self.by_record([each.square[row] for each in found], copies)[0]
            for row in range(2, len(found[0].square) - 1)
        ]
        return Way(
            np.where(np.isfinite(deviance), deviance, np.inf),
            np.array(squares).reshape(-1, self.count),
            self.by_record([each.slope for each in found], 1)[:, 0],
            self.by_record([each.fisher for each in found], 1)[:, :, 0],
            sizes[0].correlation,
            [each.trace for each in found],
        )

    def slopes(
        self, places: tuple[int, ...], point: Float[np.ndarray, " column"], way: Way
    ) -> Float[np.ndarray, "row row record"]:
        """Differentiate the innovations with the coefficients and each record's first states.

        Args:
            places: parameters that are given.
            point: their values.
            way: whose gains and deviations count.

        Returns:
            `A^T A`, see `innovation_products`: coefficients, first states, innovations; not finite where a
            motion diverged.
        """
        unit = np.eye(len(places) + len(self.starts))
        columns = [
            unit[places.index(place)] if place in places else np.zeros(0)
            for place in range(len(self._numbers))
        ]
        if self._stiffness is not None:
            free = self._stiffness in places
            number = point[places.index(self._stiffness)] if free else self._numbers[self._stiffness]
            own = number * unit[len(places) + self._states]
            columns[self._stiffness] = (columns[self._stiffness] if free else 0.0) + own
        if self._zero is not None:
            columns[self._zero] = (columns[self._zero] if self._zero in places else 0.0) + unit[-1]
        directions = tuple(map(on_device, columns))
        first = np.vstack([unit[len(places) :][: self._states], np.zeros(len(unit))])
        return self._products(places, point[None], way, directions, first)[:, :, 0]

    def squares(
        self,
        places: tuple[int, ...],
        points: Float[np.ndarray, "copy column"],
        way: Way,
        starts: Float[np.ndarray, "copy state record"] | None = None,
    ) -> Float[np.ndarray, "copy record"]:
        """Give the squared innovations at several points, with the gains of a way held.

        Args:
            places: parameters that are given.
            points: their values, `COPIES` at most.
            way: whose gains and deviations count.
            starts: means of the first states at each point; those of the filter if omitted.

        Returns:
            Their sums, over variances; not finite where a motion diverged.
        """
        # Always as many points, so that they share compiled code.
        chosen = np.minimum(np.arange(COPIES), len(points) - 1)
        still = np.zeros((self._states + 1, 0))
        begun = np.repeat(self.starts[None], len(points), axis=0) if starts is None else starts
        none = (on_device(np.zeros(0)),) * len(self._numbers)
        products = self._products(places, points[chosen], way, none, still, begun[chosen])
        return products[0, 0, : len(points)]

    def _products(
        self,
        places: tuple[int, ...],
        points: Float[np.ndarray, "copy column"],
        way: Way,
        directions: tuple[Array, ...],
        start_directions: Float[np.ndarray, "carried direction"],
        starts: Float[np.ndarray, "copy state record"] | None = None,
    ) -> Float[np.ndarray, "row row copy record"]:
        copies = len(points)

        def one(part: int) -> Array:
            trace = way.traces[part]
            if copies > 1:
                trace = jax.tree.map(lambda own: jnp.tile(own, copies), trace)
            sampling, values = self.prepared.sampling, self._values(part, places, points, starts)
            batch, memory = self._batch(part, copies), jnp.asarray(way.correlation)
            return innovation_products(
                self.followed,
                values,
                directions,
                self._start(part, copies, starts),
                on_device(start_directions),
                memory,
                trace,
                batch,
                sampling.quantity,
                self._time,
                self._tabled,
            )

        return self.by_record(self._in_parts(one), copies)

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
        motion = slice(0, self._states)
        self._centers[motion], self._prior[motion] = self.starts[motion], self.spread[motion]

    def _start(
        self, part: int, copies: int, starts: Float[np.ndarray, "copy state record"] | None = None
    ) -> State:
        rows = self._rows(part, copies, starts)[: self._states]
        return (*(on_device(row) for row in rows), on_device(np.zeros(rows.shape[1])))

    def _rows(
        self, part: int, copies: int, starts: Float[np.ndarray, "copy state record"] | None
    ) -> Float[np.ndarray, "state lane"]:
        known = self._known(part)[0]
        if starts is None:
            return np.tile(self.starts[:, known], copies)
        return np.concatenate(list(starts[:, :, known]), axis=1)

    def _values(
        self,
        part: int,
        places: tuple[int, ...],
        points: Float[np.ndarray, "copy column"],
        starts: Float[np.ndarray, "copy state record"] | None = None,
    ) -> tuple[Array, ...]:
        width, numbers = self._known(part)[1], []
        for place, number in enumerate(self._numbers):
            column = points[:, places.index(place)] if place in places else np.full(len(points), number)
            lanes = np.repeat(column, width)
            if place == self._stiffness:
                lanes = lanes * (1.0 + self._rows(part, len(points), starts)[self._states])
            if place == self._zero:
                lanes = lanes + self._rows(part, len(points), starts)[-1]
            numbers.append(on_device(lanes))
        return tuple(numbers)

    def by_record(self, parts: Sequence[Array | np.ndarray], copies: int) -> np.ndarray:
        """Join what the batches gave.

        Args:
            parts: of each batch, lanes last.
            copies: points at which the lanes run side by side.

        Returns:
            The same; the last axis has become (copy, record).
        """
        order, joined = self.prepared.order, []
        for values in map(np.asarray, parts):
            joined.append(values.reshape(*values.shape[:-1], copies, -1))
        whole = np.concatenate(joined, axis=-1)
        return whole[..., np.argsort(order)[: self.count]]

    def _batch(self, part: int, copies: int) -> Batch:
        """Give the records of a batch, as often as there are points."""
        if copies == 1:
            return self.prepared.batches[part].following(self.followed)
        if (part, copies) not in self._copied:
            batch = self.prepared.batches[part].following(self.followed)
            self._copied[part, copies] = jax.tree.map(
                lambda one: on_device(np.tile(np.asarray(one), copies)) if np.ndim(one) else one, batch
            )
        return self._copied[part, copies]
