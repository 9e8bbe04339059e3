"""Drift-free integration and band-limited differentiation in the frequency domain, without wrap-around at the
ends.
"""

import numpy as np
import scipy
from jaxtyping import Float

from .._campaign import TIME_DERIVATIVES, OutputQuantity
from .._record import Record
from ._excited_band import excited_band

_AS_STEADY = 1.2
"""Change from the first period to the second, over that of the last two, up to which a record repeats."""


def integrate_acceleration(
    acceleration: Float[np.ndarray, " time"], rate: float, lowest_frequency: float
) -> tuple[Float[np.ndarray, " time"], Float[np.ndarray, " time"]]:
    """Gives velocity and displacement of a measured acceleration, with no drift and zero mean.

    Each spectral line is divided by 2 pi i f; lines above `lowest_frequency` are kept whole, lines below a
    quarter of it dropped, with a smooth ramp between. Mirror images continue the ends, so that they do not
    wrap around. The displacement has an error of some per cent two periods of `lowest_frequency` from an
    end, and of 5e-4 from six on.

    Args:
        acceleration: [m/s^2], (time,).
        rate: Samples per second [Hz].
        lowest_frequency: Lowest frequency that matters [Hz].

    Returns:
        Velocity [m/s] and displacement [m], (time,) each.

    Raises:
        ValueError: If `lowest_frequency` is not between 0 and half the rate, or its period exceeds the
            signal.
    """
    _check_lowest(acceleration, rate, lowest_frequency)
    return (
        shift_order(acceleration, rate, -1, lowest_frequency, None),
        shift_order(acceleration, rate, -2, lowest_frequency, None),
    )


def measured_state(
    record: Record,
    output_quantity: OutputQuantity,
    lowest_frequency: float | None = None,
    highest_frequency: float | None = None,
) -> tuple[Float[np.ndarray, " time"], Float[np.ndarray, " time"], Float[np.ndarray, " time"]]:
    """Gives displacement, velocity and acceleration estimated from the measured output, whatever it is.

    The measured one is returned as it was measured. Integrals lack their mean and all below
    `lowest_frequency`; derivatives are cut above `highest_frequency`, where they would be noise. A periodic
    record that repeats from its start goes on by its period beyond its ends, another by its mirror image.
    With base excitation the state is that of the output, i.e. absolute.

    Args:
        record: The record.
        output_quantity: What its output is.
        lowest_frequency: [Hz]; default half of the lowest excited frequency, at least two per record.
        highest_frequency: [Hz]; default where the output's spectrum sinks into its noise floor.

    Returns:
        x [m], v [m/s], a [m/s^2], (time,) each.

    Raises:
        ValueError: If a frequency is not between 0 and half the rate.
    """
    if lowest_frequency is None and highest_frequency is None:
        band = excited_band(record)
        return record.once(
            ("measured state", output_quantity),
            lambda: measured_state(record, output_quantity, band.lowest, band.highest),
        )
    lowest = excited_band(record).lowest if lowest_frequency is None else lowest_frequency
    highest = excited_band(record).highest if highest_frequency is None else highest_frequency
    _check_lowest(record.output, record.rate, lowest)
    if not lowest < highest <= 0.5 * record.rate:
        raise ValueError(
            f"Argument `highest_frequency` must lie between {lowest:g} Hz and half the rate, "
            f"{0.5 * record.rate:g} Hz, but is {highest:g} Hz."
        )
    measured = TIME_DERIVATIVES[output_quantity]
    x, v, a = (
        record.output
        if order == measured
        else shift_order(
            record.output,
            record.rate,
            order - measured,
            lowest if order < measured else None,
            highest if order > measured else None,
            record.period if _repeats_from_the_start(record) else None,
        )
        for order in (0, 1, 2)
    )
    return x, v, a


def shift_order(
    signal: Float[np.ndarray, " time"],
    rate: float,
    order: int,
    lowest_frequency: float | None,
    highest_frequency: float | None,
    period: int | None = None,
) -> Float[np.ndarray, " time"]:
    """Gives the time derivative (order above 0) or integral (below 0) of a signal within a band.

    Args:
        signal: Samples, (time,).
        rate: Samples per second [Hz].
        order: Number of differentiations; negative for integrations.
        lowest_frequency: Smooth ramp from a quarter of it up to it [Hz], or None for no lower end.
        highest_frequency: Smooth ramp down from it to 1.25 times it [Hz], or None for no upper end.
        period: Samples by which the signal repeats, which continue it beyond its ends; else its mirror image
            does. At most the length of the signal.

    Returns:
        (time,).
    """
    mean = float(np.mean(signal)) if order != 0 else 0.0
    slowest = rate / signal.size if lowest_frequency is None else lowest_frequency
    pad = min(signal.size - 1, int(np.ceil(8.0 * rate / slowest)))
    length = signal.size + 2 * pad
    window = scipy.signal.windows.tukey(length, 1.5 * pad / length)
    if period is None:
        extended = _mirrored(signal - mean, pad, through=order > 0) * window
    else:
        extended = _repeated(signal - mean, pad, period) * window
    size = int(scipy.fft.next_fast_len(extended.size + pad, real=True) or extended.size + pad)
    frequency = np.fft.rfftfreq(size, 1.0 / rate)
    weight = np.ones_like(frequency)
    if lowest_frequency is not None:
        weight *= _rise(frequency, 0.25 * lowest_frequency, lowest_frequency)
    if highest_frequency is not None:
        weight *= 1.0 - _rise(frequency, highest_frequency, 1.25 * highest_frequency)
    kept = (weight > 0.0) & (frequency > 0.0)
    spectrum = np.fft.rfft(extended, size)
    spectrum[~kept] = 0.0
    spectrum[kept] *= weight[kept] * (2j * np.pi * frequency[kept]) ** order
    return np.fft.irfft(spectrum, size)[pad : pad + signal.size]


def _repeats_from_the_start(record: Record) -> bool:
    """Whether the first two periods differ no more than the last two: nothing rings down at the start."""
    if record.period is None or record.output.size < 3 * record.period:
        return False
    own = record.output[: record.output.size // record.period * record.period].reshape(-1, record.period)
    changes = np.std(np.diff(own, axis=0), axis=1)
    return bool(changes[0] <= _AS_STEADY * changes[-1])


def _repeated(signal: Float[np.ndarray, " time"], pad: int, period: int) -> Float[np.ndarray, " extended"]:
    """Gives the signal continued at both ends by the period next to each."""
    before, after = np.arange(-pad, 0) % period, np.arange(pad) % period
    return np.concatenate([signal[before], signal, signal[signal.size - period + after]])


def _mirrored(signal: Float[np.ndarray, " time"], pad: int, through: bool) -> Float[np.ndarray, " extended"]:
    """Gives the signal continued at both ends by its mirror image.

    Through the end point, value and slope go on, as a derivative needs; but the continuation's mean is off,
    which an integral multiplies. The plain image keeps the mean.
    """
    before, after = signal[pad:0:-1], signal[-2 : -pad - 2 : -1]
    if through:
        before, after = 2.0 * signal[0] - before, 2.0 * signal[-1] - after
    return np.concatenate([before, signal, after])


def _rise(
    frequency: Float[np.ndarray, " frequency"], low: float, high: float
) -> Float[np.ndarray, " frequency"]:
    share = np.clip((frequency - low) / (high - low), 0.0, 1.0)
    # three derivatives vanish at both ends: what a ramp does in time dies out the faster, the smoother it is
    return share**4 * (35.0 - 84.0 * share + 70.0 * share**2 - 20.0 * share**3)


def _check_lowest(signal: Float[np.ndarray, " time"], rate: float, lowest_frequency: float) -> None:
    if not rate / signal.size <= lowest_frequency < 0.5 * rate:
        raise ValueError(
            f"Argument `lowest_frequency` must lie between one period per signal, {rate / signal.size:.4g} "
            f"Hz, and half the rate, {0.5 * rate:g} Hz, but is {lowest_frequency:g} Hz."
        )
