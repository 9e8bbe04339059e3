"""The factor from a declared unit to SI."""

from ..reading import si_factor


def unit_factor(unit: str, quantity: str) -> float:
    """Gives the factor that takes a number in a unit to SI.

    Args:
        unit: As declared.
        quantity: What it measures.

    Returns:
        SI units a unit; 1 for a unit of another name, in a campaign that no reader has checked.
    """
    try:
        return si_factor(unit, quantity, "")
    except ValueError:
        return 1.0
