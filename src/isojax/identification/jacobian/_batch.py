"""Segments side by side: what one compiled scan takes."""

import dataclasses
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float, Int

from ..._cores import usable_cores
from ..._types import Scalar, on_device
from ...excitations import Hold
from ...models import Instant, Integrator, Isolator, Quantity
from ...records import Record, measured_state
from ._channels import channel_table, drive_table
from ._segments import Segment
from ._whitening import Whitening, find_whitening

MOST_LANES = 16
"""Segments that one scan carries on a CPU. What a step of more works on leaves the processor's nearest cache;
beside other work that makes it slow."""

SAMPLES_A_TABLE = 256
"""Tables have room for a multiple of so many samples, so that records of most lengths share compiled code."""


class Batch(eqx.Module):
    """Segments of equal sampling, padded to one length; a lane a segment.

    Attributes:
        count: samples of the longest of them.
        drive: recorded drive at the stages of each sample's integration steps [its SI unit].
        drive_rate: its time derivative.
        measured: measured output [its SI unit].
        weight: 1 where a sample counts, 0 where it does not (padding, settling).
        ringing: share of the ringing of jumps that the samples hold: 1 where they are band-limited, else 0.
        channels: signals of the records at the same times as the drive, by name.
    """

    count: Int[Array, ""]
    drive: Float[Array, "time stage lanes"]
    drive_rate: Float[Array, "time stage lanes"]
    measured: Float[Array, "time lanes"]
    weight: Float[Array, "time lanes"]
    ringing: Float[Array, ""]
    channels: dict[str, Float[Array, "time stage lanes"]] = eqx.field(default_factory=dict)

    @property
    def acting(self) -> Instant:
        """What acts, over time, stages and lanes."""
        return Instant(self.drive, self.drive_rate, self.channels)

    def following(self, model: Isolator) -> "Batch":
        """Give the batch with the channels that a model follows and no others: each is carried in the scan.

        Args:
            model: the isolator.

        Returns:
            The batch.
        """
        own = {name: self.channels[name] for name in model.channels}
        return dataclasses.replace(self, channels=own)


class Sampling(NamedTuple):
    """How segments are simulated from sample to sample, and what is read at each.

    Attributes:
        quantity: what the sensor measures.
        time: between samples [s]; an array, so that other rates share compiled code.
        integrator: what simulates the segments.
        jumps: whether the drive jumps at the samples.
        whitening: what makes the noise in the rows of a lane white, or None where it is.
    """

    quantity: Quantity
    time: Scalar
    integrator: Integrator
    jumps: bool
    whitening: Whitening | None = None


class Prepared(NamedTuple):
    """Batches of one set of segments, ready to simulate.

    Attributes:
        batches: equal shapes, the longest segments first.
        order: lanes as they run through the batches.
        segments: the segments, a lane each; padding lanes repeat none.
        record: record of each lane, padding lanes included (0 there).
        starts: measured displacement and velocity at each lane's first sample; shape (2, lanes).
        spread: rms displacement and velocity of each lane; shape (2, lanes).
        samples: samples that count in each record.
        sampling: how they are simulated and read.
    """

    batches: tuple[Batch, ...]
    order: Int[np.ndarray, " lanes"]
    segments: tuple[Segment, ...]
    record: Int[np.ndarray, " lanes"]
    starts: Float[np.ndarray, "2 lanes"]
    spread: Float[np.ndarray, "2 lanes"]
    samples: Float[np.ndarray, " record"]
    sampling: Sampling

    def own(self, values: np.ndarray, part: int) -> tuple[Array, ...]:
        """Give what belongs to the lanes of one batch, row by row.

        Args:
            values: rows of one value a lane.
            part: place of the batch.
        """
        width = self.order.size // len(self.batches)
        return tuple(on_device(row) for row in values[:, self.order[part * width : (part + 1) * width]])

    def in_lanes(self, parts: Iterable[np.ndarray]) -> np.ndarray:
        """Join what the batches gave, lanes first, in the order of the lanes.

        Args:
            parts: of each batch.
        """
        joined = np.concatenate(list(parts))
        return joined[np.argsort(self.order)]


def coordinate_motion(
    record: Record, quantity: Quantity, based: bool
) -> tuple[Float[np.ndarray, " time"], Float[np.ndarray, " time"]]:
    """Give the measured motion of the model's coordinate.

    Args:
        record: the record.
        quantity: what the sensor measures.
        based: whether the drive is the acceleration of the base, so that the coordinate is relative to it and
            a measured acceleration is not.

    Returns:
        Displacement [m] and velocity [m/s].
    """
    if based and quantity == "acceleration":
        record = dataclasses.replace(record, output=record.output - record.input)
    return measured_state(record, quantity)[:2]


def workers() -> int:
    """Give the number of threads that share a batch: the cores on a CPU, one elsewhere."""
    return usable_cores() if jax.default_backend() == "cpu" else 1


def _turned(values: Float[np.ndarray, "lanes ..."]) -> Float[Array, "... lanes"]:
    """Give a table to the device, lanes last."""
    return on_device(np.ascontiguousarray(np.moveaxis(values, 0, -1)))


_Table = tuple[Float[np.ndarray, "time stage"], Float[np.ndarray, "time stage"]]


def prepare(
    records: tuple[Record, ...],
    segments: tuple[Segment, ...],
    *,
    quantity: Quantity,
    hold: Hold,
    substeps: int,
    shift: float = 0.0,
    skew: float = 0.0,
    based: bool = False,
    channels: tuple[str, ...] = (),
    integrator: Integrator | None = None,
    whitening: tuple[float, ...] = (),
) -> Prepared:
    """Lay segments side by side.

    Args:
        records: the records that the segments refer to, equal in rate.
        segments: pieces of them.
        quantity: what the sensor measures.
        hold: what the drive does between samples.
        substeps: integration steps a sample.
        shift: time by which the drive acts later than it was recorded [s], at the start of a file.
        skew: rate at which this time grows in the course of a file [1].
        based: whether the drive is the acceleration of the base.
        channels: names of the signals of the records that are wanted beside the drive.
        integrator: what simulates the segments; RK4, which takes the steps given above, if omitted.
        whitening: coefficients of the filter that whitens the noise, see `find_whitening`.

    Returns:
        The batches and what belongs to their lanes.
    """
    how = Integrator() if integrator is None else integrator
    sizes = np.array([segment.stop - segment.start for segment in segments])
    length, width = sizes.max(), sizes.size
    if jax.default_backend() == "cpu":
        # A power of two, so that sets of all sizes share compiled code; two batches for two threads.
        width = min(1 << (-(-width // 2) - 1).bit_length(), MOST_LANES)
    if how.is_locked:
        length = -(-length // SAMPLES_A_TABLE) * SAMPLES_A_TABLE
    else:  # a solver with steps of its own goes through all samples that there are
        width = min(width, sizes.size)
    lanes = -(-sizes.size // width) * width
    # Long ones beside long ones: a batch is done when its longest segment is.
    order = np.append(np.argsort(-sizes, kind="stable"), np.arange(sizes.size, lanes))
    stages = 2 * substeps + 1
    starts, spread = np.zeros((2, lanes)), np.ones((2, lanes))
    owner, count = np.zeros(lanes, dtype=int), np.zeros(len(records))

    def known(place: int) -> tuple[_Table, tuple[np.ndarray, ...], dict[str, np.ndarray]]:
        record = records[place]
        extra = {name: channel_table(name, record, hold, substeps, shift, skew) for name in channels}
        # The last table is kept: it is large, and the next fit to these records mostly asks for it again.
        tables, key = record.once("drive table", dict), (hold, substeps, shift, skew)
        if key not in tables:
            tables.clear()
            tables[key] = drive_table(record, record.input, hold, substeps, shift, skew)
        return tables[key], coordinate_motion(record, quantity, based), extra

    with ThreadPoolExecutor(workers()) as pool:
        used = sorted({segment.record for segment in segments})
        content = dict(zip(used, pool.map(known, used), strict=True))

    def batch(first: int) -> Batch:
        # Filled lane by lane, then turned: writing across the lanes would touch a cache line a sample.
        drive, rates = np.zeros((width, length, stages)), np.zeros((width, length, stages))
        beside = {name: np.zeros((width, length, stages)) for name in channels}
        measured, weight = np.zeros((width, length)), np.zeros((width, length))
        for row, lane in enumerate(order[first : min(first + width, sizes.size)]):
            segment, size = segments[lane], sizes[lane]
            record = records[segment.record]
            (table, slopes), motion, extra = content[segment.record]
            window = slice(segment.start, segment.stop)
            drive[row, :size], rates[row, :size] = table[window], slopes[window]
            for name, values in extra.items():
                beside[name][row, :size] = values[window]
            measured[row, :size] = record.output[window]
            weight[row, segment.counted - segment.start : size] = 1.0
            owner[lane] = segment.record
            count[segment.record] += weight[row].sum()
            for state in range(2):
                starts[state, lane] = motion[state][segment.start]
                # A motion that rings down is largest at its start, far above the rms of its record.
                extent = np.ptp(motion[state][window]) if record.rings_down else np.std(motion[state][window])
                spread[state, lane] = max(extent, 1e-300)
        return Batch(
            on_device(np.asarray(sizes[order[first]])),
            _turned(drive),
            _turned(rates),
            _turned(measured),
            _turned(weight),
            on_device(np.asarray(float(how.band_limited))),
            channels={name: _turned(values) for name, values in beside.items()},
        )

    # One after the other: the tables are the largest arrays that there are.
    batches = tuple(batch(first) for first in range(0, lanes, width))
    jumps = hold == "zero_order"
    sampling = Sampling(
        quantity, on_device(np.asarray(1.0 / records[0].rate)), how, jumps, find_whitening(whitening)
    )
    return Prepared(batches, order, segments, owner, starts, spread, count, sampling)
