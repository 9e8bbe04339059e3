"""Units of parameters whose unit depends on what was measured."""

from ...records import Campaign

OUTPUT_UNITS = {"acceleration": "m/s^2", "velocity": "m/s", "displacement": "m"}
"""SI unit of each output quantity."""


def plain_unit(unit: str, campaign: Campaign) -> str:
    """Give the unit of a parameter in a campaign.

    Args:
        unit: as the element declares it.
        campaign: says what the channels measure.

    Returns:
        The unit.
    """
    if unit == "SI unit of the output":
        return OUTPUT_UNITS[campaign.output.quantity]
    if unit == "SI unit of the input":
        return "m/s^2" if campaign.input.quantity == "base_acceleration" else "N"
    return unit
