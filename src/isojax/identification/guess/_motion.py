"""The measured motion of the model's coordinate."""

import dataclasses

import numpy as np
from jaxtyping import Float

from ...records import Campaign, ExcitedBand, Record, excited_band, measured_state

_NEARER = 1.5
"""Lowest frequency to integrate, over half the lowest excited one: the higher, the shorter the margins."""

_MARGIN_PERIODS = 3.0
"""Periods of that frequency at each end whose integrals depend on what lies beyond the record."""

_LARGEST_MARGIN = 0.2
"""Largest share of the record that each margin may take."""

_BROAD = 0.1
"""Share of the highest excited frequency up to which the lowest one to integrate may be raised."""


@dataclasses.dataclass(frozen=True, eq=False)
class Motion:
    """Motion of the isolator's coordinate in one record, relative to the base under base excitation.

    Attributes:
        displacement: [m].
        velocity: [m/s].
        acceleration: [m/s^2].
        drive: the recorded drive [N, or m/s^2 for base excitation].
        band: where the motion exceeds its noise and, where it was integrated, has no drift.
        step: time from each sample to the next [s].
        margin: samples at each end whose integrals are unreliable.
        cycle: samples of a cycle, where each dwell is one and repeats; 0 where the motion goes on.
    """

    displacement: Float[np.ndarray, " time"]
    velocity: Float[np.ndarray, " time"]
    acceleration: Float[np.ndarray, " time"]
    drive: Float[np.ndarray, " time"]
    band: ExcitedBand
    step: Float[np.ndarray, " time"]
    margin: int = 0
    cycle: int = 0

    @property
    def trusted(self) -> slice:
        """The samples between the margins."""
        return slice(self.margin, self.drive.size - self.margin)

    @property
    def largest(self) -> tuple[float, float]:
        """Largest displacement [m] and velocity [m/s] between the margins."""
        displacement, velocity = (
            float(np.max(np.abs(signal[self.trusted]))) for signal in (self.displacement, self.velocity)
        )
        return displacement, velocity


def is_absolute(campaign: Campaign) -> bool:
    """Say whether the output is absolute while the model's coordinate is relative to the base.

    Args:
        campaign: says what the channels measure.

    Returns:
        True for an acceleration output under base excitation.
    """
    return campaign.input.quantity == "base_acceleration" and campaign.output.quantity == "acceleration"


def measured_motion(campaign: Campaign, record: Record, origin: float = 0.0) -> Motion:
    """Estimate the motion of the isolator's coordinate from what was measured.

    Args:
        campaign: says what the channels measure.
        record: the record.
        origin: offset of the output to subtract [its SI unit].

    Returns:
        Displacement, velocity, acceleration and drive. Where an absolute acceleration was measured under base
        excitation, the motion of the base is subtracted.
    """
    own = record
    if is_absolute(campaign) or origin != 0.0:
        own = dataclasses.replace(
            record, output=record.output - origin - (record.input if is_absolute(campaign) else 0.0)
        )
    band, margin = excited_band(own), 0
    if campaign.output.quantity != "displacement":
        lowest = min(_NEARER * band.lowest, 0.5 * band.highest)
        if record.kind == "broadband":
            # The drive may reach down to zero frequency, where the margins would take the whole record.
            whole = _MARGIN_PERIODS * record.rate / (_LARGEST_MARGIN * record.time.size)
            lowest = max(lowest, min(whole, _BROAD * band.highest))
        band = ExcitedBand(lowest, band.highest)
        margin = round(min(_MARGIN_PERIODS * record.rate / lowest, _LARGEST_MARGIN * record.time.size))
    x, v, a = measured_state(own, campaign.output.quantity, band.lowest, band.highest)
    return Motion(x, v, a, record.input, band, np.full(x.size, 1.0 / record.rate), margin)
