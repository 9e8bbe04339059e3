"""Mistakes of scale: units, factors and rates, ordered by how usual the sizes are that they leave."""

import math
from dataclasses import dataclass

import numpy as np

from .._campaign import TIME_DERIVATIVES, Campaign
from ._newton_balance import Rows
from ._suspicion import Cause
from ._unit_factor import unit_factor

_USUAL = {
    "displacement": (-3.5, 1.2),
    "acceleration": (0.0, 1.2),
    "force": (1.3, 1.4),
    "mass": (1.3, 1.5),
    "frequency": (1.2, 0.8),
}
"""log10 of sizes in SI on benches for isolators, and their standard deviations: 0.3 mm, 1 m/s^2, 20 N, 20 kg,
16 Hz, each within a decade or so. They order mistakes that are the same to the data, and decide nothing."""

_UNITS = {
    "force": ("N", "kN", "mN", "kgf", "lbf"),
    "acceleration": ("m/s^2", "g", "mg", "mm/s^2"),
    "velocity": ("m/s", "mm/s", "um/s", "in/s"),
    "displacement": ("m", "mm", "um", "cm", "in"),
}
"""Units that channels are delivered in."""

_MASSES = {"grams": 1e-3, "tonnes": 1e3, "pounds": 0.45359237}
"""kg a unit in which a mass is written by mistake."""

_RATES = (2.0, 0.5, 1e3, 1e-3)
"""Ratios by which a rate is mistaken; a thousand where milliseconds are read as seconds."""

_SAME_SIZE = 1.08
"""Factor within which a named one is meant: a pound is half a kilogram within 1.1."""

_SAME_SIZE_RATE = 1.05
"""The same for rates, which are round."""

_SIZES_NAMED = 2
"""Causes that are named where several are the same to the data."""


@dataclass(frozen=True)
class Sizes:
    """Typical magnitudes of the records, as declared.

    Attributes:
        displacement: rms [m].
        acceleration: rms [m/s^2].
        force: rms [N].
        mass: [kg].
        frequency: Middle of the driven band [Hz].
    """

    displacement: float
    acceleration: float
    force: float
    mass: float
    frequency: float

    def oddness(self) -> float:
        """Gives how far from usual the sizes are: the sum of squared standard scores."""
        return sum(
            ((math.log10(max(getattr(self, name), 1e-300)) - middle) / spread) ** 2
            for name, (middle, spread) in _USUAL.items()
        )

    def scaled(self, drive: float, motion: float, mass: float, rate: float, order: int) -> "Sizes":
        """Gives the sizes where channels, mass and rate are so many times as large.

        Args:
            drive: Factor of the input.
            motion: Factor of the output.
            mass: Factor of the mass.
            rate: Factor of the rate.
            order: How often the displacement is differentiated to give the output.
        """
        return Sizes(
            self.displacement * motion * rate**-order,
            self.acceleration * motion * rate ** (2 - order),
            self.force * drive,
            self.mass * mass,
            self.frequency * rate,
        )


def sizes_of(campaign: Campaign, rows: Rows) -> Sizes:
    """Gives the typical magnitudes of the records to fit.

    Args:
        campaign: The campaign.
        rows: The lines of its records.

    Returns:
        The sizes.
    """
    records = campaign.fit_records
    omega = float(np.median(rows.omega))
    drive = max(float(np.std(record.input)) for record in records)
    motion = max(float(np.std(record.output)) for record in records)
    displacement = motion * omega ** -TIME_DERIVATIVES[campaign.output.quantity]
    based = campaign.input.quantity == "base_acceleration"
    return Sizes(
        displacement,
        displacement * omega**2,
        drive * (campaign.mass if based else 1.0),
        campaign.mass,
        omega / (2.0 * np.pi),
    )


def scale_causes(campaign: Campaign, sizes: Sizes, inertia: float) -> tuple[Cause, ...]:
    """Gives the mistakes that make the inertia so many times the declared mass, the likeliest first.

    Force, motion and mass enter the balance as one ratio: a factor of 1000 may stand in any of them.

    Args:
        campaign: As declared.
        sizes: Its magnitudes.
        inertia: Apparent mass over the declared one, above 0.

    Returns:
        Two causes at most.
    """
    order = TIME_DERIVATIVES[campaign.output.quantity]
    named = _unit_causes(campaign, sizes, inertia, order) + _rate_causes(campaign, sizes, inertia, order)
    ordered = [cause for _, cause in sorted(named, key=lambda pair: pair[0])]
    return (*ordered, _factor_cause(campaign, inertia))[:_SIZES_NAMED]


def _unit_causes(campaign: Campaign, sizes: Sizes, inertia: float, order: int) -> list[tuple[float, Cause]]:
    found: list[tuple[float, Cause]] = []
    drive, output = campaign.input, campaign.output
    measured = "force" if drive.quantity == "force" else "acceleration"
    for section, quantity, declared, needed in (
        ("input", measured, drive.unit, 1.0 / inertia),
        ("output", output.quantity, output.unit, inertia),
    ):
        one = unit_factor(declared, quantity)
        if "V" in declared:
            continue
        for unit in _UNITS[quantity]:
            factor = unit_factor(unit, quantity) / one
            if factor == 1.0 or not _alike(factor, needed, _SAME_SIZE):
                continue
            after = (
                sizes.scaled(factor, 1.0, 1.0, 1.0, order)
                if section == "input"
                else sizes.scaled(1.0, factor, 1.0, 1.0, order)
            )
            words = f"the {section} is in {unit}, not in {declared}"
            found.append((after.oddness(), Cause(f"{section} unit", words, f'[{section}] unit = "{unit}"')))
    if drive.quantity != "base_acceleration":
        for unit, factor in _MASSES.items():
            if _alike(factor, inertia, _SAME_SIZE):
                after = sizes.scaled(1.0, 1.0, factor, 1.0, order)
                line = f"[campaign] mass = {campaign.mass * factor:.4g}"
                found.append((after.oddness(), Cause("mass unit", f"the mass is written in {unit}", line)))
    return found


def _rate_causes(campaign: Campaign, sizes: Sizes, inertia: float, order: int) -> list[tuple[float, Cause]]:
    return [
        (after.oddness(), rate_cause(campaign, factor))
        for factor in _RATES
        if order < 2 and _alike(factor ** (2 - order), inertia, _SAME_SIZE_RATE)
        for after in (sizes.scaled(1.0, 1.0, 1.0, factor, order),)
    ]


def rate_cause(campaign: Campaign, factor: float) -> Cause:
    """Gives the cause that the rate is so many times as high as declared."""
    words = f"the sampling rate is {factor:g} times as high"
    if factor == 1e3:
        words = "the times are in milliseconds, not in seconds"
    return Cause("rate", words, f"[sampling] rate = {campaign.rate * factor:.6g}")


def _factor_cause(campaign: Campaign, inertia: float) -> Cause:
    drive = campaign.input
    lines = []
    if drive.quantity != "base_acceleration":
        lines.append(f"[campaign] mass = {campaign.mass * inertia:.4g}")
    if drive.moving_mass is not None:
        lines.append(f"[input] moving_mass = {drive.moving_mass / inertia:.4g}")
    else:
        lines.append(f"[input] gain = {drive.gain / inertia:.4g}")
    return Cause("mass or gain", "the mass, or the gain of a channel, is wrong", ", or ".join(lines))


def _alike(factor: float, needed: float, within: float) -> bool:
    return abs(math.log(factor / needed)) < math.log(within)
