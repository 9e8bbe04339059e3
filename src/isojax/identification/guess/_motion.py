"""The measured motion of the model's coordinate."""

import dataclasses

import numpy as np
from jaxtyping import Float

from ...records import Band, Campaign, Record, excited_band, measured_state

_NEARER = 1.5
"""Lowest frequency to integrate, over half the lowest excited one: the nearer, the shorter the stray ends."""

_PERIODS = 3.0
"""Periods of that frequency at each end whose integrals still feel what lies beyond the record."""

_SHARE = 0.2
"""The ends never take more than this share of the record each."""

_BROAD = 0.1
"""Share of the highest excited frequency to which the lowest one to integrate is raised at most."""


@dataclasses.dataclass(frozen=True, eq=False)
class Motion:
    """Motion of the isolator's coordinate in one record, relative to the base under base excitation.

    Attributes:
        displacement: [m].
        velocity: [m/s].
        acceleration: [m/s^2].
        drive: the recorded drive [N, or m/s^2 for base excitation].
        band: where the motion stands above its noise and, where it was integrated, has no drift.
        margin: samples at each end whose integrals are not to be trusted.
    """

    displacement: Float[np.ndarray, " time"]
    velocity: Float[np.ndarray, " time"]
    acceleration: Float[np.ndarray, " time"]
    drive: Float[np.ndarray, " time"]
    band: Band
    margin: int = 0

    @property
    def trusted(self) -> slice:
        """The samples between the margins."""
        return slice(self.margin, self.drive.size - self.margin)


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
        origin: offset of the output to take off [its SI unit].

    Returns:
        Displacement, velocity, acceleration and drive. Where an absolute acceleration was measured under base
        excitation, the motion of the base is taken off.
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
            # Of a drive that reaches down to nothing: below this the record is all ends.
            whole = _PERIODS * record.rate / (_SHARE * record.time.size)
            lowest = max(lowest, min(whole, _BROAD * band.highest))
        band = Band(lowest, band.highest)
        margin = round(min(_PERIODS * record.rate / lowest, _SHARE * record.time.size))
    x, v, a = measured_state(own, campaign.output.quantity, band.lowest, band.highest)
    return Motion(x, v, a, record.input, band, margin)
