"""Segments side by side: what one compiled scan takes."""

import dataclasses
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._cores import usable_cores
from ...excitations import Hold
from ...models import Instant, Integrator, Isolator, Quantity
from ...records import Record, measured_state
from ._channels import channel_table, drive_table
from ._segments import Segment
from ._whitening import Whitening, find_whitening


class Batch(eqx.Module):
    """Segments of equal sampling, padded to one length; a lane a segment.

    Attributes:
        drive: recorded drive at the stages of each sample's integration steps [its SI unit].
        drive_rate: its time derivative.
        measured: measured output [its SI unit].
        weight: 1 where a sample counts, 0 where it does not (padding, settling).
        channels: signals of the records at the same times as the drive, by name.
    """

    drive: Float[Array, "time stage lanes"]
    drive_rate: Float[Array, "time stage lanes"]
    measured: Float[Array, "time lanes"]
    weight: Float[Array, "time lanes"]
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
        return Batch(self.drive, self.drive_rate, self.measured, self.weight, channels=own)


class Sampling(NamedTuple):
    """How segments are simulated from sample to sample, and what is read at each.

    Attributes:
        quantity: what the sensor measures.
        time: between samples [s].
        integrator: what simulates the segments.
        jumps: whether the drive jumps at the samples.
        whitening: what makes the noise in the rows of a lane white, or None where it is.
    """

    quantity: Quantity
    time: float
    integrator: Integrator
    jumps: bool
    whitening: Whitening | None = None


class Prepared(NamedTuple):
    """Batches of one set of segments, ready to simulate.

    Attributes:
        batches: equal shapes, one a worker thread; lanes run through them in order.
        segments: the segments, a lane each; padding lanes repeat none.
        record: record of each lane, padding lanes included (0 there).
        starts: measured displacement and velocity at each lane's first sample; shape (2, lanes).
        spread: rms displacement and velocity of each lane; shape (2, lanes).
        samples: samples that count in each record.
        sampling: how they are simulated and read.
    """

    batches: tuple[Batch, ...]
    segments: tuple[Segment, ...]
    record: Int[np.ndarray, " lanes"]
    starts: Float[np.ndarray, "2 lanes"]
    spread: Float[np.ndarray, "2 lanes"]
    samples: Float[np.ndarray, " record"]
    sampling: Sampling


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
    room: tuple[Segment, ...] = (),
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
        room: segments for which there shall be room, too: tables of one shape share their compiled code.
        integrator: what simulates the segments; RK4, which takes the steps given above, if omitted.
        whitening: coefficients of the filter that whitens the noise, see `find_whitening`.

    Returns:
        The batches and what belongs to their lanes.
    """
    length = max(segment.stop - segment.start for segment in (*segments, *room))
    most = max(len(segments), len(room))
    threads = min(workers(), most)
    lanes = -(-most // threads) * threads
    stages = 2 * substeps + 1
    # Filled lane by lane, then turned: writing across the lanes would touch a cache line a sample.
    drive, rates = np.zeros((lanes, length, stages)), np.zeros((lanes, length, stages))
    beside = {name: np.zeros((lanes, length, stages)) for name in channels}
    measured, weight = np.zeros((lanes, length)), np.zeros((lanes, length))
    starts, spread = np.zeros((2, lanes)), np.ones((2, lanes))
    owner = np.zeros(lanes, dtype=int)

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
    for lane, segment in enumerate(segments):
        record = records[segment.record]
        (table, slopes), motion, extra = content[segment.record]
        window = slice(segment.start, segment.stop)
        size = segment.stop - segment.start
        drive[lane, :size], rates[lane, :size] = table[window], slopes[window]
        for name, values in extra.items():
            beside[name][lane, :size] = values[window]
        measured[lane, :size] = record.output[window]
        weight[lane, segment.counted - segment.start : size] = 1.0
        owner[lane] = segment.record
        for state in range(2):
            starts[state, lane] = motion[state][segment.start]
            # A motion that rings down is largest at its start, far above the rms of its record.
            size = np.ptp(motion[state][window]) if record.rings_down else np.std(motion[state][window])
            spread[state, lane] = max(size, 1e-300)
    share = lanes // threads

    def turned(values: np.ndarray, first: int) -> Array:
        return jnp.moveaxis(jnp.asarray(values[first : first + share]), 0, -1)

    batches = tuple(
        Batch(
            *(turned(values, first) for values in (drive, rates, measured, weight)),
            channels={name: turned(values, first) for name, values in beside.items()},
        )
        for first in range(0, lanes, share)
    )
    count = np.bincount(owner, weights=weight.sum(axis=1), minlength=len(records))
    how = Integrator() if integrator is None else integrator
    jumps = hold == "zero_order"
    sampling = Sampling(quantity, 1.0 / records[0].rate, how, jumps, find_whitening(whitening))
    return Prepared(batches, segments, owner, starts, spread, count, sampling)
