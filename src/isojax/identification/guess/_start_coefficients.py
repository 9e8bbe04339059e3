"""Coefficients to start from, for records with dwells and for those without."""

import dataclasses

import numpy as np

from ...models import Isolator
from ...records import Campaign, Record
from ._decay_cycles import start_from_decays
from ._dwell_balance import dwell_balance, dwell_motion
from ._force_balance import BalanceFit, ForceBalance
from ._linear_response import LinearResponse, linear_response
from ._logarithmic_decrement import Decrement, about_rest, logarithmic_decrement
from ._measured_receptance import MeasuredResponse
from ._motion import measured_motion
from ._physical_fit import fit_physically
from ._restoring_force import band_projections
from ._sensor_offset_start import output_mean


@dataclasses.dataclass(frozen=True, eq=False)
class TimeStart:
    """The start that records without dwells give.

    Attributes:
        fit: coefficients from the force balance.
        linear: best linear receptance of each driven record.
        decrements: logarithmic decrement of each free decay, by record name.
        notes: what the reader must know, a sentence each.
    """

    fit: BalanceFit
    linear: tuple[LinearResponse, ...]
    decrements: dict[str, Decrement]
    notes: tuple[str, ...]


def start_from_dwells(
    base: Isolator, names: tuple[str, ...], responses: tuple[MeasuredResponse, ...], mass_free: bool
) -> tuple[BalanceFit, tuple[str, ...]]:
    """Start from the harmonic balance of every dwell."""
    motion = dwell_motion(base, responses)
    return fit_physically(dwell_balance(base, responses, mass_free=mass_free).fit, names, *motion.largest)


def start_from_time(
    campaign: Campaign, base: Isolator, names: tuple[str, ...], records: tuple[Record, ...], mass_free: bool
) -> TimeStart:
    """Start from records without dwells: by the force balance in time, or by the cycles of free decays alone.

    Args:
        campaign: says what the channels measure.
        base: the declared structure.
        names: catalogue names of the elements to fit.
        records: broadband, periodic, swept or freely decaying records.
        mass_free: whether the mass is unknown too.

    Returns:
        The fit, linear receptances, decrements, notes.
    """
    origin = output_mean(campaign) if campaign.output.offset_free else 0.0
    motions = tuple(measured_motion(campaign, record, origin) for record in records)
    released = all(record.rings_down for record in records)
    by_cycles = start_from_decays(campaign, base, names, records) if released else None
    projections = band_projections(campaign, records, motions)
    highest, fastest = (max(sizes) for sizes in zip(*(motion.largest for motion in motions), strict=True))
    fit, notes = by_cycles or fit_physically(
        ForceBalance(base, motions, projections, mass_free).fit, names, highest, fastest
    )
    factor = -float(base.mass) if base.excitation == "base_acceleration" else 1.0
    linear = tuple(
        linear_response(record, motion, factor * motion.drive)
        for record, motion in zip(records, motions, strict=True)
        if record.kind != "free_decay" and np.any(motion.drive)
    )
    decrements = {
        record.name: logarithmic_decrement(about_rest(record.output), record.rate)
        for record in records
        if record.rings_down
    }
    return TimeStart(fit, linear, decrements, notes)
