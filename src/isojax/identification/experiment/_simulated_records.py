"""A planned experiment carried out on a model: the records that it would give."""

import dataclasses
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._kept import recall
from ...models import RK4, Instant, Isolator, Quantity, State, add_ringing, read_record, scan_records
from ...records import Dwell, Record
from ..fitting import Problem
from ..jacobian import carries, channel_table, drive_table
from ._candidate_experiments import DWELLS, Experiment


class TrialRun(NamedTuple):
    """An experiment on a model.

    Attributes:
        records: what the test rig would record, free of noise.
        starts: initial state of each segment, records in turn.
        displacement: of each record [m].
    """

    records: tuple[Record, ...]
    starts: Float[np.ndarray, "state segment"]
    displacement: Float[np.ndarray, "record time"]

    @property
    def is_finite(self) -> bool:
        """Whether the motion stayed finite."""
        return bool(np.all(np.isfinite(self.starts)) and np.all(np.isfinite(self.displacement)))


@eqx.filter_jit
def _run(
    model: Isolator, record: Instant, start: State, quantity: Quantity, sample_time: float
) -> tuple[State, Array]:
    """Give states and readings at the samples; the record is over time, stage and lanes."""
    _, path, ringing = scan_records(
        model, RK4(), quantity, sample_time, start, record, lambda state, at: state
    )
    reading = read_record(model, path, record.pick(np.s_[:, 0]), quantity)
    return path, add_ringing(reading, ringing)


def blank_records(experiment: Experiment) -> tuple[Record, ...]:
    """Give the records of an experiment before it was made: no output yet."""
    rows, total = experiment.drive.shape
    length = total // DWELLS
    records = []
    for row, drive in enumerate(experiment.drive):
        dwells = ()
        if experiment.stepped:
            lines = np.abs(np.fft.rfft(drive.reshape(DWELLS, length), axis=1))
            dwells = tuple(
                Dwell(place * length, (place + 1) * length, cycles * experiment.rate / length, float(cycles))
                for place, cycles in enumerate(np.argmax(lines, axis=1).tolist())
            )
        nothing = np.zeros(total)
        records.append(
            Record(
                f"{experiment.name}_{row}",
                Path(f"{experiment.name}_{row}"),
                np.arange(total) / experiment.rate,
                experiment.rate,
                drive,
                nothing,
                drive,
                nothing,
                level=float(np.std(drive)),
                period=None if experiment.stepped else total,
                dwells=dwells,
                kind="stepped_sine" if experiment.stepped else "periodic",
                clock=(row / rows, (row + 1) / rows),
            )
        )
    return tuple(records)


def missing_channels(model: Isolator, records: tuple[Record, ...]) -> tuple[str, ...]:
    """Name the signals that a model follows and that a planned record does not have."""
    return tuple(name for name in model.channels if not all(carries(record, name) for record in records))


def trial_run(
    model: Isolator, experiment: Experiment, blank: tuple[Record, ...], problem: Problem, rest: float
) -> TrialRun:
    """Carry out an experiment on a model.

    The simulation of each segment starts from rest one segment earlier, so that it starts as the one before
    it ends; the first of a record follows its last.

    Args:
        model: the isolator, as the experiment has it.
        experiment: the test.
        blank: its records, still without output.
        problem: the campaign's records: what the drive does between samples, the integration steps, and what
            the sensor measures; that of the experiment may measure another quantity.
        rest: rest position [m].

    Returns:
        The records; not finite where the motion diverges.
    """
    rows, total = experiment.drive.shape
    length, hold = total // DWELLS, problem.hold
    clock = float(model.shift()), float(model.skew())
    substeps = problem.integrator.record_steps(model)
    window = (np.arange(2 * length)[:, None] + (np.arange(DWELLS) - 1) * length) % total

    def side_by_side(tables: Iterable[Float[np.ndarray, "time stage"]]) -> Array:
        lanes = [np.moveaxis(table[window], 2, 1) for table in tables]
        return jnp.asarray(np.concatenate(lanes, axis=2))

    tables = [drive_table(record, record.input, hold, substeps, *clock) for record in blank]
    channels = {
        name: side_by_side([channel_table(name, record, hold, substeps, *clock) for record in blank])
        for name in model.channels
    }
    lanes = rows * DWELLS
    start = (jnp.full(lanes, rest), *(jnp.zeros(lanes),) * (1 + model.internal_states))

    def compute() -> tuple[np.ndarray, ...]:
        path, reading = _run(
            model,
            Instant(*(side_by_side(values) for values in zip(*tables, strict=True)), channels=channels),
            start,
            problem.quantity,
            1.0 / experiment.rate,
        )
        return (*map(np.asarray, path), np.asarray(reading))

    *path, reading = recall("trial run", compute, model, experiment, problem.quantity, rest)

    def in_turn(values: Float[np.ndarray, "time lanes"]) -> Float[np.ndarray, "record sample"]:
        return values[length:].T.reshape(rows, total)

    displacement = in_turn(path[0])
    outputs = displacement if experiment.quantity != problem.quantity else in_turn(reading)
    records = tuple(
        dataclasses.replace(record, output=output, raw_output=output)
        for record, output in zip(blank, outputs, strict=True)
    )
    starts = np.stack([state[length] for state in path])
    return TrialRun(records, starts, displacement)
