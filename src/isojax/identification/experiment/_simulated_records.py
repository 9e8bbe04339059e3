"""A planned experiment carried out on a model: the records that it would give."""

import dataclasses
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..._kept import recall
from ..._quick_jit import quick_jit
from ...models import RK4, Instant, Isolator, Quantity, State, add_ringing, read_record, scan_records
from ...records import Dwell, ExcitationKind, Record
from ..diagnosis import Experiment, Waveform
from ..fitting import Problem
from ..jacobian import carries, channel_table, drive_table


class TrialRun(NamedTuple):
    """An experiment on a model.

    Attributes:
        records: what the test rig would record, free of noise.
        path: displacement, velocity and internal states at each sample [SI units].
    """

    records: tuple[Record, ...]
    path: Float[np.ndarray, "state record time"]

    @property
    def displacement(self) -> Float[np.ndarray, "record time"]:
        """Displacement [m]."""
        return self.path[0]

    @property
    def finite(self) -> Bool[np.ndarray, " record"]:
        """Whether the motion of each record stayed finite."""
        return np.all(np.isfinite(self.path), axis=(0, 2))


@quick_jit
def _run(
    model: Isolator, record: Instant, start: State, quantity: Quantity, sample_time: float
) -> tuple[State, Array]:
    """Give states and readings at the samples; the record is over time, stage and lanes."""
    _, path, ringing = scan_records(
        model, RK4(), quantity, sample_time, start, record, lambda state, at: state
    )
    reading = read_record(model, path, record.pick(np.s_[:, 0]), quantity)
    return path, add_ringing(reading, ringing)


def blank_records(experiment: Experiment, clock: tuple[float, float] | None = None) -> tuple[Record, ...]:
    """Give the records of an experiment before it was made: no output yet.

    Args:
        experiment: the test.
        clock: start and end of every record as shares of the campaign; one after the other through all of it
            if omitted.

    Returns:
        The records.
    """
    rows, total = experiment.drive.shape
    kinds: dict[Waveform, ExcitationKind] = {
        "stepped sine": "stepped_sine",
        "swept sine": "swept",
        "multisine": "periodic",
    }
    sines = experiment.waveform != "multisine"
    nothing = np.zeros(total)
    conditions: list[dict[str, Any]] = [dict(one) for one in experiment.conditions or [()] * rows]
    return tuple(
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
            direction="none"
            if not sines
            else "backward"
            if (row % 2 == 1) != experiment.backward
            else "forward",
            period=None if sines else total,
            dwells=dwells_of(drive, experiment.rate, experiment.dwells)
            if experiment.waveform == "stepped sine"
            else (),
            kind=kinds[experiment.waveform],
            clock=(row / rows, (row + 1) / rows) if clock is None else clock,
            **conditions[row],
        )
        for row, drive in enumerate(experiment.drive)
    )


def dwells_of(drive: Float[np.ndarray, " time"], rate: float, dwells: int) -> tuple[Dwell, ...]:
    """Give the dwells of a record of equally long sines of whole cycles.

    Args:
        drive: of the record.
        rate: samples a second [Hz].
        dwells: how many.

    Returns:
        The dwells.
    """
    length = drive.size // dwells
    cycles = np.argmax(np.abs(np.fft.rfft(drive.reshape(dwells, length), axis=1)), axis=1)
    return tuple(
        Dwell(place * length, (place + 1) * length, count * rate / length, float(count))
        for place, count in enumerate(cycles.tolist())
    )


def missing_channels(model: Isolator, records: tuple[Record, ...]) -> tuple[str, ...]:
    """Name the signals that a model follows and that a planned record does not have."""
    return tuple(name for name in model.channels if not all(carries(record, name) for record in records))


def trial_run(
    model: Isolator, experiment: Experiment, blank: tuple[Record, ...], problem: Problem, rest: float
) -> TrialRun:
    """Carry out an experiment on a model: each record from rest to its end, all of them side by side.

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
    hold = problem.hold
    clock = float(model.shift()), float(model.skew())
    substeps = problem.integrator.record_steps(model)

    def side_by_side(tables: Iterable[Float[np.ndarray, "time stage"]]) -> Array:
        return jnp.asarray(np.stack(list(tables), axis=2))

    tables = [drive_table(record, record.input, hold, substeps, *clock) for record in blank]
    channels = {
        name: side_by_side(channel_table(name, record, hold, substeps, *clock) for record in blank)
        for name in model.channels
    }
    lanes = len(blank)
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
    outputs = path[0] if experiment.quantity != problem.quantity else reading
    records = tuple(
        dataclasses.replace(record, output=output, raw_output=output)
        for record, output in zip(blank, outputs.T, strict=True)
    )
    return TrialRun(records, np.stack([state.T for state in path]))
