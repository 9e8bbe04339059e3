"""Least-squares harmonics of a dwell: amplitudes of input and output where a cycle is no whole number of
samples.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float

from ..._show import shown
from .._record import Dwell, Record
from ._basis import harmonic_basis as harmonic_basis
from ._basis import meeting_order, usable_orders
from ._mains import hum_lines

_FEWEST_SETTLED = 4.0
"""Cycles at the end of a dwell, a third of them and at least so many, that are taken for settled."""


@shown
@dataclass(frozen=True, eq=False)
class DwellHarmonics:
    """Complex amplitudes of a settled dwell: signal = Re sum_k c_k exp(2 pi i k frequency t), t from the
    dwell's start.

    Attributes:
        frequency: Excitation frequency [Hz].
        cycles: Number of cycles they were taken from.
        input: c_0 (mean) to c_H of the input, in its unit.
        output: The same of the output.
        input_residual: rms of the input without its harmonics, per degree of freedom.
        output_residual: The same of the output.
        masked: Orders that coincide with a significant line of the mains; they are 0.
    """

    frequency: float
    cycles: float
    input: Complex[np.ndarray, " harmonic"]
    output: Complex[np.ndarray, " harmonic"]
    input_residual: float
    output_residual: float
    masked: tuple[int, ...] = ()


def settled_window(dwell: Dwell, rate: float, settled_cycles: float | None = None) -> tuple[int, int]:
    """Gives first sample and one past the last of the settled end of a dwell.

    Args:
        dwell: The dwell.
        rate: Samples per second [Hz].
        settled_cycles: Cycles at the end to keep; default a third of them, at least 4.

    Returns:
        Samples, counted from the start of the record.
    """
    whole = max(1.0, np.floor(dwell.cycles + 1e-6))
    kept = max(_FEWEST_SETTLED, np.floor(whole / 3.0)) if settled_cycles is None else settled_cycles
    length = round(min(kept, whole) * rate / dwell.frequency)
    return max(dwell.start, dwell.stop - length), dwell.stop


def fit_harmonics(
    signal: Float[np.ndarray, " time"], time: Float[np.ndarray, " time"], frequency: float, harmonics: int
) -> tuple[Complex[np.ndarray, " harmonic"], float]:
    """Gives the complex amplitudes 0..harmonics of a signal and the rms residual per degree of freedom."""
    basis = harmonic_basis(time, frequency, harmonics)
    # Harmonics over whole cycles are nearly orthogonal, so the normal equations lose no digits.
    solution = np.linalg.solve(basis.T @ basis, basis.T @ signal)
    rest = signal - basis @ solution
    freedom = max(signal.size - basis.shape[1], 1)
    amplitudes = np.concatenate([solution[:1] + 0j, solution[1::2] + 1j * solution[2::2]])
    return amplitudes, float(np.sqrt(rest @ rest / freedom))


def dwell_harmonics(
    record: Record, dwell: Dwell, harmonics: int = 7, settled_cycles: float | None = None
) -> DwellHarmonics:
    """Gives the complex amplitudes of input and output over the settled last cycles of a dwell.

    Args:
        record: The record.
        dwell: One of its dwells.
        harmonics: Highest order; orders above 0.9 of half the rate are returned as 0.
        settled_cycles: Cycles at the dwell's end to use; default a third of them, at least 4.

    Returns:
        Orders 0 to `harmonics`.

    Raises:
        ValueError: If the window has fewer samples than coefficients.
    """
    start, stop = settled_window(dwell, record.rate, settled_cycles)
    fitted = usable_orders(record.rate, dwell.frequency, harmonics)
    if stop - start <= 2 * fitted + 1:
        raise ValueError(
            f"Argument `dwell` of record {record.name} must leave more than {2 * fitted + 1} settled "
            f"samples for {fitted} harmonics, but leaves {stop - start}."
        )
    time = (np.arange(start, stop) - dwell.start) / record.rate
    drive, drive_rest = fit_harmonics(record.input[start:stop], time, dwell.frequency, fitted)
    response, response_rest = fit_harmonics(record.output[start:stop], time, dwell.frequency, fitted)
    meeting = [
        meeting_order(dwell.frequency, line.frequency, (stop - start) / record.rate)
        for line in hum_lines(record)
    ]
    masked = tuple(order for order in meeting if order is not None and order <= fitted)
    for order in masked:
        drive[order] = response[order] = 0.0
    missing = np.zeros(harmonics - fitted, dtype=np.complex128)
    return DwellHarmonics(
        frequency=dwell.frequency,
        cycles=(stop - start) * dwell.frequency / record.rate,
        input=np.concatenate([drive, missing]),
        output=np.concatenate([response, missing]),
        input_residual=drive_rest,
        output_residual=response_rest,
        masked=masked,
    )
