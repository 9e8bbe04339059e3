"""The force balance of records without dwells: in time, projected on its low-frequency lines."""

import numpy as np
from jaxtyping import Float
from scipy.signal.windows import tukey

from ...records import TIME_DERIVATIVES, Campaign, ExcitedBand, Record
from ._force_balance import BalanceProjection
from ._motion import Motion
from ._scales import excited_centre


def line_projection(
    motion: Motion, rate: float, band: ExcitedBand, derivatives: int, centre: float
) -> BalanceProjection:
    """Give the projection on the Fourier lines of a band, which low-passes without a phase.

    A smooth window removes the ends of the record, where derivatives and integrals are unreliable. Lines
    above `centre` get a smaller weight, as the noise of a differentiated response rises.

    Args:
        motion: the motion, whose margins are left out.
        rate: samples a second [Hz].
        band: the lines that count [Hz]; a lower end of zero keeps the mean.
        derivatives: how often the response was differentiated to give the acceleration.
        centre: centre of the band [Hz].

    Returns:
        The projection.
    """
    size = motion.drive.size
    window = np.pad(tukey(size - 2 * motion.margin, 0.1), motion.margin)
    frequency = np.fft.rfftfreq(size, 1.0 / rate)
    kept = (frequency >= band.lowest) & (frequency <= band.highest)
    weight = 1.0 / (1.0 + (frequency[kept] / centre) ** derivatives) / np.sqrt(size)

    def project(force: Float[np.ndarray, " time"]) -> Float[np.ndarray, " row"]:
        lines = np.fft.rfft(force * window)[kept] * weight
        return np.concatenate([lines.real, lines.imag])

    return project


def band_projections(
    campaign: Campaign, records: tuple[Record, ...], motions: tuple[Motion, ...]
) -> tuple[BalanceProjection, ...]:
    """Give the projections with which the force balance in time is fitted, low-passed.

    Args:
        campaign: says what the output measures, and which offsets are free: one of them may take up the mean
            force, which then counts where a displacement was measured. Else only what lies above the lowest
            excited frequency counts.
        records: the records.
        motions: their measured motion and drive.

    Returns:
        One a record.

    Source: Masri & Caughey 1979; the same filter on force and on every regressor keeps the balance exact (A.
    Janot, P.-O. Vandanjon and M. Gautier, A generic instrumental variable approach for industrial robot
    identification, IEEE Trans. Control Syst. Technol. 22 (2014) 132).
    """
    quantity = campaign.output.quantity
    offset_free = campaign.input.offset_free or campaign.output.offset_free
    keeps_mean = offset_free and quantity == "displacement"
    derivatives = TIME_DERIVATIVES["acceleration"] - TIME_DERIVATIVES[quantity]
    return tuple(
        line_projection(
            motion,
            campaign.rate,
            ExcitedBand(0.0, motion.band.highest) if keeps_mean else motion.band,
            derivatives,
            excited_centre(record, motion) / (2 * np.pi),
        )
        for record, motion in zip(records, motions, strict=True)
    )
