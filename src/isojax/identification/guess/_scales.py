"""Typical magnitudes of a campaign."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from jaxtyping import Float

from ..._quantities import CONDITIONS
from ...elements import Scales
from ...records import Campaign, Record
from ..jacobian import workers
from ._motion import Motion, measured_motion

_PERIODS_A_WINDOW = 4.0
"""Periods of the band's centre in a window whose velocity amplitude is estimated."""

_MOVED = 1e-3
"""Velocity amplitude of a window, over the largest, below which it did not move."""


def _amplitude(signals: list[Float[np.ndarray, " _"]]) -> float:
    """Give the amplitude of the sine that is as strong as the strongest of these signals."""
    return max(float(np.sqrt(2.0) * np.std(signal)) for signal in signals)


def _largest(record: Record, motion: Motion, signal: Float[np.ndarray, " time"]) -> float:
    """Give the amplitude of an estimated signal: of an equally strong sine, where its integrals are reliable.

    A motion that rings down is largest where they are not; there its peak is used all the same.
    """
    if record.rings_down:
        return float(np.max(np.abs(signal)))
    return _amplitude([signal[motion.trusted]])


def excited_centre(record: Record, motion: Motion) -> float:
    """Give the centre of the excited band.

    Args:
        record: the record.
        motion: its measured motion.

    Returns:
        Angular frequency [rad/s]: the mean over the dwells, else the centroid of the drive's power (of the
        motion's, where nothing drives).
    """
    if record.dwells:
        return 2 * np.pi * float(np.mean([dwell.frequency for dwell in record.dwells]))
    driven = np.std(record.input) > 0 and not record.rings_down
    signal = record.input if driven else motion.displacement
    power = np.abs(np.fft.rfft((signal - np.mean(signal)) * np.hanning(signal.size))) ** 2
    omega = 2 * np.pi * np.fft.rfftfreq(signal.size, 1.0 / record.rate)
    power[0] = 0.0
    return float(np.sum(omega * power) / np.sum(power)) if np.any(power > 0) else float(omega[1])


def _slowest(record: Record, motion: Motion, centre: float) -> float:
    """Give the smallest velocity amplitude [m/s] among the dwells, or among windows that moved."""
    if record.dwells:
        spans = [(dwell.start, dwell.stop) for dwell in record.dwells]
    else:
        length = min(
            record.time.size - 2 * motion.margin,
            max(8, round(_PERIODS_A_WINDOW * 2 * np.pi / centre * record.rate)),
        )
        trusted = range(record.time.size)[motion.trusted]
        spans = [(start, start + length) for start in range(trusted.start, trusted.stop - length + 1, length)]
    speeds = np.array([np.sqrt(2.0) * np.std(motion.velocity[start:stop]) for start, stop in spans])
    return float(np.min(speeds[speeds > _MOVED * np.max(speeds)], initial=np.max(speeds)))


def scales(campaign: Campaign) -> Scales:
    """Give the typical magnitudes of the records to fit.

    Args:
        campaign: the campaign.

    Returns:
        Mass [kg], force [N], motion [m, m/s, m/s^2] and so on; amplitudes are sqrt(2) times the standard
        deviation of the strongest record.

    Raises:
        ValueError: if no record has the role "fit", or the output never moves.
    """
    records = campaign.fit_records
    if not records:
        raise ValueError(f'{campaign.file} must have at least one record with role "fit", but has none.')
    with ThreadPoolExecutor(workers()) as pool:
        motions = list(pool.map(lambda record: measured_motion(campaign, record), records))
    reading = _amplitude([record.output for record in records])
    if reading == 0:
        raise ValueError(f"The output of {campaign.file} must move, but is constant in every record to fit.")
    centres = [excited_centre(record, motion) for record, motion in zip(records, motions, strict=True)]
    pairs = list(zip(records, motions, strict=True))
    acceleration = _amplitude([motion.acceleration for motion in motions])
    force = _amplitude([motion.drive for motion in motions])
    if campaign.input.quantity == "base_acceleration":
        force *= campaign.mass
    return Scales(
        mass=campaign.mass,
        # A free decay has no drive, so its inertia is the typical force.
        force=force if force > 0 else campaign.mass * acceleration,
        displacement=max(_largest(record, motion, motion.displacement) for record, motion in pairs),
        velocity=max(_largest(record, motion, motion.velocity) for record, motion in pairs),
        acceleration=acceleration,
        angular_frequency=float(np.mean(centres)),
        sample_time=1.0 / campaign.rate,
        slowest_velocity=min(_slowest(*pair, centre) for pair, centre in zip(pairs, centres, strict=True)),
        reading=reading,
        largest_reading=max(float(np.max(np.abs(record.output))) for record in records),
        **_conditions(records),
    )


def _conditions(records: tuple[Record, ...]) -> dict[str, float]:
    """Give the mean of each operating condition that all records state [SI]."""
    stated = {name: [getattr(record, name) for record in records] for name in CONDITIONS}
    return {name: float(np.mean(values)) for name, values in stated.items() if None not in values}
