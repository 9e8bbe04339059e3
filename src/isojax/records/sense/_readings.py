"""The channels as declared, and as they would be with one mistake undone."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy

from .._campaign import TIME_DERIVATIVES, Campaign, InputQuantity, OutputQuantity
from .._record import Record
from ._lines import lines_of
from ._newton_balance import Rows, find_lag, rows_of
from ._suspicion import Cause
from ._unit_factor import unit_factor

_SHORTEST_RECORD = 64
"""Samples without which a record is left out: its integrals are all margin."""

_PASSES = 2
"""Searches for a delay, each after the last one is undone."""

_PLAIN = {"acceleration": "m/s^2", "velocity": "m/s", "displacement": "m", "force": "N"}


@dataclass(frozen=True)
class Reading:
    """How the columns are read.

    Attributes:
        drive: What the input measures.
        response: What the output measures.
        swapped: Whether the columns change places.
        drive_factor: Factor of the input.
        response_factor: Factor of the output.
        delay: By how much earlier the drive acts than it is recorded [s].
        skew: By how much earlier, for each second since the start of the file [1].
    """

    drive: InputQuantity
    response: OutputQuantity
    swapped: bool = False
    drive_factor: float = 1.0
    response_factor: float = 1.0
    delay: float = 0.0
    skew: float = 0.0

    @property
    def based(self) -> bool:
        """Whether the base is driven."""
        return self.drive == "base_acceleration"

    @property
    def has_inertia(self) -> bool:
        """Whether the balance says what the inertia is: not where the absolute acceleration stands for it."""
        return not (self.based and self.response == "acceleration")


def declared_reading(campaign: Campaign) -> Reading:
    """Gives the reading that is declared."""
    return Reading(campaign.input.quantity, campaign.output.quantity)


def rows_read(campaign: Campaign, reading: Reading) -> Rows | None:
    """Gives the lines of the driven records to fit.

    Args:
        campaign: The records.
        reading: How the columns are read.

    Returns:
        The lines; None where they are too few.
    """
    records = [
        record
        for record in campaign.fit_records
        if record.kind != "free_decay" and record.time.size >= _SHORTEST_RECORD
    ]
    lines = [lines_of(_read(record, reading), reading.response, reading.based) for record in records]
    return rows_of(lines, reading.has_inertia)


def _read(record: Record, reading: Reading) -> Record:
    drive, response = record.input, record.output
    if reading.swapped:
        drive, response = response, drive
    if reading.delay or reading.skew:
        clock = (np.arange(drive.size) + record.start) / record.rate
        acts = clock + reading.delay + reading.skew * clock
        drive = scipy.interpolate.CubicSpline(clock, drive)(np.clip(acts, clock[0], clock[-1]))
    if (drive is record.input) and reading.drive_factor == 1.0 == reading.response_factor:
        return record
    return replace(record, input=drive * reading.drive_factor, output=response * reading.response_factor)


def other_readings(campaign: Campaign) -> Iterator[tuple[Reading, Cause]]:
    """Gives the readings with one mistake undone, and the mistake.

    Args:
        campaign: As declared.

    Returns:
        Columns swapped; another quantity of the output or of the input; under base excitation with an
        absolute acceleration, whose balance has no inertia, also another sign or unit.
    """
    drive, output, declared = campaign.input, campaign.output, declared_reading(campaign)
    measured = drive.quantity if drive.quantity in ("force", "command") else "acceleration"
    si = unit_factor(drive.unit, measured)
    whole = si * drive.gain * (-drive.moving_mass if drive.moving_mass is not None else 1.0)
    response = unit_factor(output.unit, output.quantity)
    yield (
        replace(declared, swapped=True, drive_factor=whole / response, response_factor=response / whole),
        Cause(
            "channels swapped",
            "the columns of input and output are swapped",
            f'[input] column = "{output.column}", [output] column = "{drive.column}"',
        ),
    )
    for quantity in TIME_DERIVATIVES:
        if quantity != output.quantity:
            yield (
                replace(declared, response=quantity, response_factor=1.0 / response),
                Cause(
                    "output quantity",
                    f"the output is a {quantity}, not a {output.quantity}".replace("a acc", "an acc"),
                    f'[output] quantity = "{quantity}", unit = "{_PLAIN[quantity]}"',
                ),
            )
    others: tuple[InputQuantity, ...] = ("force", "base_acceleration")
    for other in others if drive.quantity != "command" else ():
        if other != drive.quantity:
            named = other.replace("_", " ")
            unit = _PLAIN["force" if other == "force" else "acceleration"]
            yield (
                replace(declared, drive=other, drive_factor=drive.gain / whole),
                Cause(
                    "input quantity",
                    f"the input is a {named}, not a {drive.quantity.replace('_', ' ')}",
                    f'[input] quantity = "{other}", unit = "{unit}"',
                ),
            )
    if not declared.has_inertia:
        yield replace(declared, response_factor=-1.0), sign_cause(campaign)
        for unit in ("m/s^2", "g", "mm/s^2", "mg"):
            factor = unit_factor(unit, "acceleration") / response
            if factor != 1.0:
                yield (
                    replace(declared, response_factor=factor),
                    Cause(
                        "output unit",
                        f"the output is in {unit}, not in {output.unit}",
                        f'[output] unit = "{unit}"',
                    ),
                )
            own = unit_factor(unit, "acceleration") / si
            if own != 1.0:
                yield (
                    replace(declared, drive_factor=own),
                    Cause(
                        "input unit",
                        f"the input is in {unit}, not in {drive.unit}",
                        f'[input] unit = "{unit}"',
                    ),
                )


def sign_cause(campaign: Campaign) -> Cause:
    """Gives the cause that one channel has the wrong sign."""
    return Cause(
        "sign", "one of the channels has the wrong sign", f"[input] gain = {-campaign.input.gain:.6g}"
    )


def late_readings(campaign: Campaign) -> Iterator[Reading]:
    """Gives the readings with the best delay, and with the best skew of two clocks, undone.

    Args:
        campaign: As declared.

    Returns:
        The two; none where there is nothing to shift.
    """
    declared = declared_reading(campaign)
    # Without an inertia the drive stands in the laws as well. There base over response is a polynomial in
    # the frequency, as force over displacement is.
    sought = declared if declared.has_inertia else Reading("force", "displacement")
    for name in ("delay", "skew"):
        found = 0.0
        # The first shift is that of whole windows, which is exact for the short rest of it.
        for _ in range(_PASSES):
            rows = rows_read(campaign, replace(sought, **{name: found}))
            if rows is None:
                return
            found += find_lag(rows, np.ones_like(rows.middle) if name == "delay" else rows.middle)
        yield replace(declared, **{name: found})
