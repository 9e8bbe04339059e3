"""How a quantity answers to each coefficient."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...stability import Sensitivity
from ..words import typeset_number
from ._style import AFTER, BEFORE, MEASURED, axes_for, entitle, parameter_label


def plot_sensitivity(
    sensitivity: Sensitivity,
    quantity: str,
    *,
    index: tuple[int, ...] | int = (),
    parameter_errors: Mapping[str, float] | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw by how many per cent a quantity changes for one per cent of each parameter.

    Of a complex quantity, its modulus. The whiskers are the change by one standard error of each parameter,
    about the end of its bar, and the title gives the standard error of the quantity itself from all together.

    Args:
        sensitivity: the derivatives.
        quantity: name of the quantity.
        index: which entry of an array, such as a cell of a map.
        parameter_errors: standard errors by parameter [SI units], such as a fit's.
        ax: axes to draw on.

    Returns:
        The figure.

    Raises:
        ValueError: if the quantity is unknown or `index` does not lead to one number.
    """
    if quantity not in sensitivity.values:
        raise ValueError(
            f"Argument `quantity` must be one of {', '.join(sensitivity.values)}, but is {quantity!r}."
        )
    entry = index if isinstance(index, tuple) else (index,)
    values = np.asarray(sensitivity.values[quantity])
    if len(entry) != values.ndim:
        raise ValueError(
            f"Argument `index` must lead to one number of {quantity!r}, but is {index} for shape "
            f"{values.shape}."
        )
    value = values[entry]
    at = np.asarray(sensitivity.at)
    slope = np.real(np.asarray(sensitivity.derivatives[quantity])[(slice(None), *entry)] / value)
    known = np.flatnonzero(np.isfinite(slope * at))
    known = known[np.argsort(-np.abs(slope[known] * at[known]), kind="stable")]
    figure, ax = axes_for(ax, 6.4, 1.1 + 0.27 * max(3, known.size))
    relative = slope[known] * at[known]
    rows = np.arange(known.size)
    colours = [AFTER if change >= 0.0 else BEFORE for change in relative]
    ax.barh(rows, relative, height=0.62, color=colours)
    errors = {} if parameter_errors is None else parameter_errors
    whiskers = np.array([abs(slope[k]) * errors.get(sensitivity.parameters[k], 0.0) for k in known])
    if whiskers.any():
        words = "± one standard error of the parameter"
        ax.errorbar(
            relative,
            rows,
            xerr=100.0 * whiskers,
            fmt="none",
            ecolor=MEASURED,
            capsize=2.5,
            linewidth=1.0,
            label=words,
        )
    ax.axvline(0.0, color=MEASURED, linewidth=0.8)
    ax.set_yticks(rows, [parameter_label(sensitivity.parameters[place]) for place in known])
    ax.invert_yaxis()
    ax.grid(False, axis="y")
    ax.set_xlabel("change of the quantity for 1 % more of the parameter [%]")
    error = ""
    if sensitivity.standard_errors is not None:
        error = f" ± {typeset_number(float(np.asarray(sensitivity.standard_errors[quantity])[entry]), 2)}"
    size = float(np.abs(value)) if np.iscomplexobj(value) else float(value)
    name = quantity.replace("_", " ")
    entitle(
        ax, f"{f'|{name}|' if np.iscomplexobj(value) else name} = {typeset_number(size)}{error} (SI units)"
    )
    return figure
