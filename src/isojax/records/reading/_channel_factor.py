"""The unit of a channel, and the factor that takes its column to SI: unit, gain and moving mass."""

from pathlib import Path
from typing import Any

from ..formats import Column
from ._channel_units import si_factor, unit_in_force
from ._declaration import Declaration

_MEASURES = {
    "force": "force",
    "base_acceleration": "acceleration",
    "reaction_mass_acceleration": "acceleration",
    "command": "command",
}


def channel_factor(declared: Declaration, section: str, column: Column, file: Path) -> tuple[str, float]:
    """Gives the unit of a channel in a data file, and what its column is multiplied by.

    Args:
        declared: The declaration.
        section: "input", "output", "floor", or "sampling" for the time column.
        column: The column as the file holds it.
        file: The data file, for errors.

    Returns:
        The declared unit, else that which the file states; SI units of the channel per unit of the column.

    Raises:
        ValueError: If there is no unit, if the two contradict each other, or if it is none of the quantity.
    """
    fields, where = declared.sections[section], f"{declared.file}: [{section}] unit"
    quantity, name = _quantity(section, fields), fields["time" if section == "sampling" else "column"]
    if section == "sampling" and fields["unit"] is None and column.unit is None:
        return "s", 1.0
    unit = unit_in_force(fields["unit"], column.unit, quantity, name, where, file)
    if fields["unit"] is None:
        where = f"{file}: the unit of column `{name}`"
    return unit, _sign_and_gain(fields) * si_factor(unit, quantity, where)


def check_units(declared: Declaration) -> None:
    """Refuses declared units that do not measure their quantity, before a data file is opened."""
    for section in ("input", "output", "floor", "sampling"):
        fields = declared.sections[section]
        if fields is not None and fields["unit"] is not None:
            si_factor(fields["unit"], _quantity(section, fields), f"{declared.file}: [{section}] unit")


def _quantity(section: str, fields: dict[str, Any]) -> str:
    if section == "sampling":
        return "time"
    return _MEASURES[fields["quantity"]] if section == "input" else str(fields["quantity"])


def _sign_and_gain(fields: dict[str, Any]) -> float:
    """Gives the gain; of a reaction mass, whose force is opposite to its acceleration, times -mass."""
    mass = fields.get("moving_mass")
    return float(fields.get("gain", 1.0)) * (1.0 if mass is None else -float(mass))
