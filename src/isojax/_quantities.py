"""Physical numbers in words: value, error and unit with as many digits as they deserve."""

import math
import re

INPUT_WORDS = {
    "force": ("force", "N"),
    "base_acceleration": ("base acceleration", "m/s^2"),
    "reaction_mass_acceleration": ("force of the reaction mass", "N"),
    "command": ("gain × command", "N"),
}
"""What the input of each quantity is once it is read, and its SI unit."""

DRIVE_UNITS = {excitation: INPUT_WORDS[excitation][1] for excitation in ("force", "base_acceleration")}
"""SI unit of the drive of an isolator, by its `excitation`."""

CONDITIONS = {"pressure": "Pa", "temperature": "K"}
"""Operating conditions that a record may state, with their units: fields of `Record`, and of [[record]]."""

_RAISED = str.maketrans("0123456789-.", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻·")
_UNKNOWN = "–"


def typeset_unit(unit: str) -> str:
    """Give a unit with raised exponents; nothing for a pure number.

    Args:
        unit: such as "N s^2/m^2".

    Returns:
        Such as "N s²/m²".
    """
    return "" if unit == "1" else typeset_formula(unit)


def typeset_formula(formula: str) -> str:
    """Give a formula with raised exponents.

    Args:
        formula: such as "|x|^1.5 v".

    Returns:
        Such as "|x|¹·⁵ v".
    """
    return re.sub(r"\^(-?\d+(?:\.\d+)?)", lambda found: found.group(1).translate(_RAISED), formula)


def finite_or_none(value: float) -> float | None:
    """Give a number as JSON holds it: None where it is not finite."""
    return float(value) if math.isfinite(value) else None


def typeset_number(value: float, digits: int = 4) -> str:
    """Give a number with a power of ten where that reads better.

    Args:
        value: the number.
        digits: significant digits.

    Returns:
        Such as "3.983", "-7.139×10⁸"; a dash for what is not finite.
    """
    if not math.isfinite(value):
        return _UNKNOWN
    if value == 0.0:
        return "0"
    power = _power(value)
    if -3 <= power < 5:
        return f"{value:.{max(0, digits - 1 - power)}f}"
    return f"{value / 10.0**power:.{digits - 1}f}×10{str(power).translate(_RAISED)}"


def typeset_with_error(value: float, error: float, unit: str) -> str:
    """Give a value with its standard error, both to the second digit of the error.

    Args:
        value: the value.
        error: its standard error; NaN where it has none.
        unit: their unit.

    Returns:
        Such as "3.983 ± 0.051 N", "(-7.139 ± 0.019)×10⁸ N/m²".
    """
    unit = typeset_unit(unit)
    if not math.isfinite(value) or not math.isfinite(error) or error <= 0.0:
        return f"{typeset_number(value)} {unit}".rstrip()
    power = _power(value) if value else _power(error)
    power = power if abs(value) >= error else _power(error)
    shift = 0 if -3 <= power < 5 else power
    decimals = max(0, 1 - _power(error) + shift)
    numbers = f"{value / 10.0**shift:.{decimals}f} ± {error / 10.0**shift:.{decimals}f}"
    if not shift:
        return f"{numbers} {unit}".rstrip()
    return f"({numbers})×10{str(shift).translate(_RAISED)} {unit}".rstrip()


def typeset_p_value(p_value: float) -> str:
    """Give a chance; what is too small to matter only as a limit.

    Args:
        p_value: the chance, 0 to 1.

    Returns:
        Such as "0.03", "< 10⁻⁶".
    """
    if not math.isfinite(p_value):
        return _UNKNOWN
    if p_value < 1e-6:
        return "< 10⁻⁶"
    return f"{p_value:.2g}" if p_value >= 1e-3 else typeset_number(p_value, 2)


def typeset_goodness(chi2_per_dof: float, decimals: int = 3) -> str:
    """Give chi2/dof with fixed decimals, so that rows compare.

    Args:
        chi2_per_dof: the number.
        decimals: how many, below a hundred.

    Returns:
        Such as "0.986", "2.855".
    """
    known = math.isfinite(chi2_per_dof) and abs(chi2_per_dof) < 100.0
    return f"{chi2_per_dof:.{decimals}f}" if known else typeset_number(chi2_per_dof, 3)


def typeset_share(share: float) -> str:
    """Give a share in percent.

    Args:
        share: 1 is all.

    Returns:
        Such as "4.03 %", "99.7 %".
    """
    if not math.isfinite(share):
        return _UNKNOWN
    return f"{typeset_number(100.0 * share, 3)} %"


def _power(value: float) -> int:
    """Give the power of ten of the first digit, after rounding to three."""
    return int(f"{abs(value):.2e}".partition("e")[2])
