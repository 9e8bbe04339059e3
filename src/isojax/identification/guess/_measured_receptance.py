"""Measured receptance of one stepped-sine record: displacement over the measured force, dwell by dwell."""

import dataclasses

import numpy as np
from jaxtyping import Complex, Float

from ..._show import shown
from ...records import TIME_DERIVATIVES, Campaign, Record, dwell_harmonics
from ._motion import is_absolute

DROPPED_OUT = 1e-3
"""Share of the strongest drive below which a dwell is left out."""

UNSTEADY = 0.05
"""Share of its first harmonic that the harmonics of a steady dwell may leave."""

UNSTEADY_NOISE = 6.0
"""Times the median of what all dwells leave, which is noise, that a steady dwell may leave as well."""


@shown
@dataclasses.dataclass(frozen=True, eq=False)
class MeasuredResponse:
    """Harmonics of one stepped-sine record, dwell by dwell in order of frequency.

    A signal is the real part of the sum of `amplitude_h exp(i h omega t)`, h = 1, 2, ...

    Attributes:
        record: name of the record.
        level: declared level, or None.
        direction: "forward", "backward" or "none".
        frequency: [Hz].
        force: measured force, by harmonic [N].
        displacement: measured displacement, by harmonic [m]; relative to the base under base excitation.
        left_out: frequencies of the dwells that were not steady or not driven [Hz].

    Source: the paper, sec. 4; every line is divided by its own measured force, since a shaker near resonance
    does not hold its nominal force.
    """

    record: str
    level: float | None
    direction: str
    frequency: Float[np.ndarray, " frequency"]
    force: Complex[np.ndarray, "frequency harmonic"]
    displacement: Complex[np.ndarray, "frequency harmonic"]
    left_out: Float[np.ndarray, " left_out"]

    @property
    def receptance(self) -> Complex[np.ndarray, " frequency"]:
        """First harmonic of displacement over force [m/N]."""
        return self.displacement[:, 0] / self.force[:, 0]


def measured_receptance(campaign: Campaign, record: Record, harmonics: int = 7) -> MeasuredResponse:
    """Measure the receptance of a stepped-sine record at each dwell.

    Args:
        campaign: says what the channels measure.
        record: a record with dwells.
        harmonics: how many harmonics to keep.

    Returns:
        Force and displacement by dwell and harmonic; dwells without force (the drive dropped out) are left
        out.

    Raises:
        ValueError: if the record has no dwells.
    """
    if not record.dwells:
        raise ValueError(f"Argument `record` must have dwells, but {record.name} has none.")
    order = TIME_DERIVATIVES[campaign.output.quantity]
    frequency = np.array([dwell.frequency for dwell in record.dwells])
    measured = [dwell_harmonics(record, dwell, harmonics) for dwell in record.dwells]
    drive = np.stack([one.input[1:] for one in measured])
    output = np.stack([one.output[1:] for one in measured])
    rest = np.array([(one.input_residual, one.output_residual) for one in measured])
    size = np.abs(np.stack([drive[:, 0], output[:, 0]], axis=1))
    noise = np.median(rest, axis=0)
    steady = np.all((rest <= UNSTEADY * size) | (rest <= UNSTEADY_NOISE * noise), axis=1)
    kept = steady & (size[:, 0] > DROPPED_OUT * np.max(size[:, 0])) & (size[:, 1] > 0)
    if is_absolute(campaign):
        output = output - drive
    if campaign.input.quantity == "base_acceleration":
        drive = -campaign.mass * drive
    angular = 2j * np.pi * frequency[:, None] * np.arange(1, harmonics + 1)
    places = np.flatnonzero(kept)[np.argsort(frequency[kept], kind="stable")]
    return MeasuredResponse(
        record=record.name,
        level=record.level,
        direction=record.direction,
        frequency=frequency[places],
        force=drive[places],
        displacement=(output / angular**order)[places],
        left_out=np.sort(frequency[~kept]),
    )
