"""Receptance X/F of each dwell, from whatever was measured, and the effect of a filter on it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float

from ..._show import shown
from .._campaign import TIME_DERIVATIVES, Campaign, OutputQuantity
from .._record import Record
from ._basis import usable_orders
from ._filter import zero_phase_butterworth
from ._harmonics import fit_harmonics, settled_window


@shown
@dataclass(frozen=True, eq=False)
class Receptance:
    """First harmonics of the settled dwells of one record.

    Attributes:
        frequency: [Hz], (frequency,).
        force: Force on the mass [N] ([input unit] for a command), (frequency,).
        displacement: [m], (frequency,); with base excitation relative to the base.
        receptance: displacement / force [m/N], (frequency,).
    """

    frequency: Float[np.ndarray, " frequency"]
    force: Complex[np.ndarray, " frequency"]
    displacement: Complex[np.ndarray, " frequency"]
    receptance: Complex[np.ndarray, " frequency"]


@shown
@dataclass(frozen=True, eq=False)
class FilterComparison:
    """Receptances of one record before and after a low-pass on both channels alike.

    Attributes:
        raw: From the channels as measured.
        filtered: From the filtered channels.
    """

    raw: Receptance
    filtered: Receptance


def receptance(campaign: Campaign, record: Record) -> Receptance:
    """Gives the receptance of every dwell of a stepped-sine record.

    Amplitudes are those of x = Re(X exp(2 pi i f t)); an acceleration is divided by -(2 pi f)^2, a velocity
    by 2 pi i f. With base excitation F = -mass * base acceleration and X = (A_base - A) / (2 pi f)^2.

    Args:
        campaign: The campaign, for what its channels are.
        record: One of its stepped-sine records.

    Returns:
        One complex number per dwell.

    Raises:
        ValueError: If the record has no dwells.

    Source:
        The paper's eq. (4); relative coordinate for base excitation.
    """
    return _receptance_of(campaign, record, record.input, record.output)


def compare_filtered_receptance(
    campaign: Campaign, record: Record, order: int | None = None, cutoff_hz: float | None = None
) -> FilterComparison:
    """Gives the receptance of a record raw and filtered: a low-pass on both channels alike must leave it
    unchanged.

    Args:
        campaign: The campaign.
        record: One of its stepped-sine records.
        order: Order of the filter; default the campaign's.
        cutoff_hz: Cut-off [Hz]; default the campaign's.

    Returns:
        Both receptances.

    Raises:
        ValueError: If no filter is given or declared, or the record has no dwells.

    Source:
        The paper's Fig. 8.
    """
    declared = campaign.filter
    order = declared.order if order is None and declared is not None else order
    cutoff_hz = declared.cutoff_hz if cutoff_hz is None and declared is not None else cutoff_hz
    if order is None or cutoff_hz is None:
        raise ValueError(
            f"Arguments `order` and `cutoff_hz` must be given, since {campaign.file} has no [filter], but "
            f"are {order} and {cutoff_hz}."
        )
    drive, response = (
        zero_phase_butterworth(one, record.rate, order, cutoff_hz)
        for one in (record.raw_input, record.raw_output)
    )
    return FilterComparison(
        raw=_receptance_of(campaign, record, record.raw_input, record.raw_output),
        filtered=_receptance_of(campaign, record, drive, response),
    )


def to_displacement(
    amplitude: Complex[np.ndarray, " frequency"],
    frequency: Float[np.ndarray, " frequency"],
    quantity: OutputQuantity,
) -> Complex[np.ndarray, " frequency"]:
    """Gives displacement amplitudes [m] of amplitudes of acceleration, velocity or displacement."""
    return amplitude / (2j * np.pi * frequency) ** TIME_DERIVATIVES[quantity]


def _receptance_of(
    campaign: Campaign,
    record: Record,
    drive: Float[np.ndarray, " time"],
    response: Float[np.ndarray, " time"],
) -> Receptance:
    if not record.dwells:
        raise ValueError(
            f"Argument `record` must be a stepped sine with dwells, but {record.name} is {record.kind} "
            "without any."
        )
    frequency = np.array([dwell.frequency for dwell in record.dwells])
    amplitudes = np.empty((2, frequency.size), dtype=np.complex128)
    for i, dwell in enumerate(record.dwells):
        start, stop = settled_window(dwell, record.rate)
        time = (np.arange(start, stop) - dwell.start) / record.rate
        orders = max(1, usable_orders(record.rate, dwell.frequency, 7))
        for channel, signal in enumerate((drive, response)):
            amplitudes[channel, i] = fit_harmonics(signal[start:stop], time, dwell.frequency, orders)[0][1]
    force, moved = amplitudes[0], to_displacement(amplitudes[1], frequency, campaign.output.quantity)
    if campaign.input.quantity == "base_acceleration":
        moved = moved - to_displacement(force, frequency, "acceleration")
        force = -campaign.mass * force
    return Receptance(frequency, force, moved, moved / force)
