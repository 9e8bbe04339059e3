"""Least-squares bases for a dwell: harmonics of its frequency, and lines of the mains beside them."""

import functools

import numpy as np
from jaxtyping import Float

USABLE_SHARE = 0.45
"""Frequencies up to this share of the sampling rate, 0.9 of half of it, are estimated."""

_RESOLVED = 0.25
"""Phase, in turns over a window, by which a line and a harmonic must differ to be resolved."""


def usable_orders(rate: float, frequency: float, most: int) -> int:
    """Gives how many harmonics of a frequency lie below 0.45 of the sampling rate, at most `most`."""
    return min(most, int(USABLE_SHARE * rate / frequency))


def harmonic_basis(
    time: Float[np.ndarray, " time"], frequency: float, harmonics: int
) -> Float[np.ndarray, "time column"]:
    """Gives the columns 1, cos wt, -sin wt, cos 2wt, ...; coefficients are Re and Im of the complex
    amplitudes.

    Args:
        time: Seconds, (time,).
        frequency: [Hz].
        harmonics: Highest order.

    Returns:
        (time, 1 + 2 harmonics).
    """
    turns = np.exp(2j * np.pi * frequency * time)[:, None] ** np.arange(1, harmonics + 1)
    basis = np.ones((time.size, 1 + 2 * harmonics))
    basis[:, 1::2], basis[:, 2::2] = turns.real, -turns.imag
    return basis


def without(
    basis: Float[np.ndarray, "time column"], signal: Float[np.ndarray, " time"]
) -> Float[np.ndarray, " time"]:
    """Gives what the columns leave of a signal, by the normal equations.

    Args:
        basis: (time, column); over whole cycles, harmonics are all but orthogonal.
        signal: (time,).

    Returns:
        (time,).
    """
    return signal - basis @ np.linalg.solve(basis.T @ basis, basis.T @ signal)


def meeting_order(frequency: float, line: float, seconds: float) -> int | None:
    """Gives the harmonic that a window cannot separate from a line, such as the tenth of 5 Hz from 50 Hz.

    Args:
        frequency: Of the dwell [Hz].
        line: Of the mains [Hz].
        seconds: Length of the window.

    Returns:
        Its order, 2 or more; None where the window separates all of them.
    """
    order = round(line / frequency)
    return order if order >= 2 and abs(order * frequency - line) * seconds < _RESOLVED else None


@functools.lru_cache(maxsize=64)
def drifting_harmonics(
    window: int, rate: float, frequency: float, orders: int, lines: tuple[float, ...] = ()
) -> tuple[
    Float[np.ndarray, "time column"], Float[np.ndarray, "column column"], Float[np.ndarray, " column"]
]:
    """Gives harmonics whose fundamental drifts linearly, lines beside them, the inverse of their products.

    Where the window cannot separate a line from a harmonic, that harmonic may drift too. The records of a
    campaign dwell at the same frequencies and share the result.

    Args:
        window: Samples.
        rate: Samples per second [Hz].
        frequency: Of the dwell [Hz].
        orders: Highest harmonic.
        lines: Of the mains [Hz].

    Returns:
        Columns (time, column), the inverse of their products, and the frequency of each column [Hz].
    """
    time = (np.arange(window) - 0.5 * (window - 1)) / rate
    basis = harmonic_basis(time, frequency, orders)
    slope = (time / time[-1])[:, None]
    columns = [basis, slope * basis[:, :3]]
    multiples = np.repeat(np.arange(orders + 1), 2)[1:]
    frequencies = [frequency * multiples, frequency * multiples[:3]]
    for line in lines:
        order = meeting_order(frequency, line, window / rate)
        if order is None:
            columns.append(harmonic_basis(time, line, 1)[:, 1:])
        elif order <= orders:
            columns.append(slope * basis[:, 2 * order - 1 : 2 * order + 1])
        else:
            continue
        frequencies.append(np.full(2, line))
    design = np.concatenate(columns, axis=1)
    return design, np.linalg.inv(design.T @ design), np.concatenate(frequencies)
