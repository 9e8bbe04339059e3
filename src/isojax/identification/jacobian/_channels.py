"""Signals of a record beside its drive, which effects follow: clock, holds, hum, floor, pressure, others."""

from typing import cast, get_args

import numpy as np
from jaxtyping import Float
from scipy.signal import hilbert
from scipy.signal.windows import blackmanharris

from ..._quantities import CONDITIONS
from ...elements import CATALOGUE
from ...excitations import Hold, tabulate
from ...records import Record


def effects_without_signal(records: tuple[Record, ...]) -> tuple[str, ...]:
    """Name the effects that follow a signal which some of these records do not have.

    Args:
        records: the records.

    Returns:
        Catalogue names.
    """
    followed = {name for kind in CATALOGUE.values() for name in kind.channels}
    absent = {name for name in followed if not all(carries(record, name) for record in records)}
    # An operating condition that never changes says nothing.
    absent |= {name for name in CONDITIONS if len({getattr(record, name) for record in records}) == 1}
    return tuple(name for name, kind in CATALOGUE.items() if absent.intersection(kind.channels))


def carries(record: Record, name: str) -> bool:
    """Say whether a signal means anything in a record.

    The phase of a drive is that of a sine or a sweep; a line must lie below half the sampling rate; a floor
    or an operating condition must have been measured.

    Args:
        record: the record.
        name: of the signal, as in `channel_table`.

    Returns:
        Whether there is such a signal.
    """
    kind, _, rest = name.partition("_")
    if kind == "drive":
        return record.kind in ("stepped_sine", "swept")
    if kind == "hum":
        return record.rate > 2.0 * float(rest)
    return name not in ("floor", *CONDITIONS) or getattr(record, name) is not None


def channel_table(
    name: str, record: Record, hold: Hold, substeps: int, shift: float, skew: float = 0.0
) -> Float[np.ndarray, "time stage"]:
    """Give a signal of a record at the stages of the integration steps.

    Args:
        name: "clock": time of the test, 0 at its start and 1 at its end. "elapsed": time since the start of
            the record's file [s]. "hold_zero_order", "hold_linear", "hold_band_limited": the drive as another
            hold would give it, less the declared one's.
            "drive_cosine_2", "drive_sine_2" and so on: the drive's amplitude times the cosine and sine of so
            many times its phase. "hum_50", "hum_60": a cosine of that frequency [Hz] and of amplitude one,
            with the phase that the record's output has there. "floor": measured acceleration of the floor
            [m/s^2], band-limited between its samples. "pressure" [Pa], "temperature" [K]: those of the
            record, constant.
        record: the record.
        hold: what its drive does between samples.
        substeps: integration steps a sample.
        shift: time by which the drive acts later than it was recorded [s], at the start of the file.
        skew: rate at which this time grows in the course of the file [1].

    Returns:
        The signal; `2 substeps + 1` equidistant times from one sample to the next.

    Raises:
        ValueError: if there is no such signal, or this record has none.
    """
    if name == "floor":
        if record.floor is None:
            raise ValueError(
                f"Record {record.name} must hold the motion of the floor, but no [floor] is declared."
            )
        return tabulate(record.floor, record.rate, "band_limited", substeps)[0]
    if name in CONDITIONS:
        if not carries(record, name):
            raise ValueError(f"Record {record.name} must state its {name}, but none is declared.")
        return np.full((record.input.size, 2 * substeps + 1), getattr(record, name))
    kind, _, rest = name.partition("_")
    if kind == "hold" and rest in get_args(Hold):
        other, _ = drive_table(record, record.input, cast(Hold, rest), substeps, shift, skew)
        return other - drive_table(record, record.input, hold, substeps, shift, skew)[0]
    if kind == "drive":
        part, _, order = rest.partition("_")
        harmonic = drive_harmonic(record, int(order), part)
        return drive_table(record, harmonic, "linear", substeps, shift, skew)[0]
    stages = np.arange(2 * substeps + 1) / (2.0 * substeps)
    time = (np.arange(record.input.size)[:, None] + stages) / record.rate
    if name == "elapsed":
        return time + record.start / record.rate
    if name == "clock":
        begin, end = record.clock
        return begin + (end - begin) * time * record.rate / record.input.size
    if kind == "hum":
        line = output_line(record, float(rest))
        return np.cos(2.0 * np.pi * float(rest) * time + np.angle(line))
    raise ValueError(f"Argument `name` must name a signal of a record, but is {name!r}.")


def drive_table(
    record: Record, values: Float[np.ndarray, " time"], hold: Hold, substeps: int, shift: float, skew: float
) -> tuple[Float[np.ndarray, "time stage"], Float[np.ndarray, "time stage"]]:
    """Give a signal on the clock of the drive, and its derivative, at the stages of the integration steps.

    Args:
        record: the record.
        values: its drive, or a signal made from it.
        hold: what the signal does between samples.
        substeps: integration steps a sample.
        shift: time by which the drive acts later than it was recorded [s], at the start of the file.
        skew: rate at which this time grows in the course of the file [1].

    Returns:
        See `tabulate`.
    """
    return tabulate(values, record.rate, hold, substeps, shift + skew * record.start / record.rate, skew)


def drive_harmonic(record: Record, order: int, part: str) -> Float[np.ndarray, " time"]:
    """Give a multiple of the drive's phase, with the drive's amplitude.

    The phase is that of the analytic signal, so that it means something where the drive is a sine or a sweep.

    Args:
        record: the record.
        order: how many times the phase.
        part: "cosine" or "sine".

    Returns:
        The signal [SI unit of the drive].

    Source: Gabor 1946.
    """
    turned: np.ndarray = np.asarray(hilbert(record.input - np.mean(record.input)), dtype=complex)
    size = np.abs(turned)
    multiple = size * np.exp(1j * order * np.angle(turned))
    return np.real(multiple) if part == "cosine" else np.imag(multiple)


def line_coherence(samples: int) -> float:
    """Give the correlation of white noise's line as `output_line` reads it with the line of all its samples.

    Args:
        samples: of the record.

    Returns:
        `sum(w) / sqrt(N sum(w^2))` of the window, one over the square root of its equivalent noise bandwidth.

    Source: Harris 1978, Proc. IEEE 66:51, eq. (11).
    """
    window = blackmanharris(samples)
    return float(np.sum(window) / np.sqrt(samples * np.sum(window**2)))


def output_line(record: Record, frequency: float) -> complex:
    """Give the line of the output at a frequency that nothing in the record need be locked to.

    Args:
        record: the record.
        frequency: of the line [Hz].

    Returns:
        Its complex amplitude, phase counted from the record's start [SI unit of the output].

    Source: four-term Blackman-Harris window, whose sidelobes lie 92 dB down (Harris 1978).
    """
    window = blackmanharris(record.output.size)
    time = np.arange(record.output.size) / record.rate
    turned = (record.output - np.mean(record.output)) * np.exp(-2j * np.pi * frequency * time)
    return complex(2.0 * np.sum(window * turned) / np.sum(window))
