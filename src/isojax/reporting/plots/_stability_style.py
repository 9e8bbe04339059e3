"""How stability is drawn: solid stable, dashed unstable, a marker for each bifurcation, words for axes."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from ...models import Band, Isolator
from ...stability import CodimensionTwoPoint, SpecialPoint
from ..words import DRIVE_UNITS, typeset_unit
from ._style import AFTER, BEFORE, LEVELS

MILLIMETRES = 1e3

_DASHES = (0, (4, 2))


class Mark(NamedTuple):
    """How a bifurcation is drawn.

    Attributes:
        words: what it is called.
        marker: its form.
        colour: its filling.
    """

    words: str
    marker: str
    colour: str


MARKS: Mapping[str, Mark] = {
    "fold": Mark("fold", "o", BEFORE),
    "period_doubling": Mark("period doubling", "s", "#e9c46a"),
    "neimark_sacker": Mark("Neimark-Sacker", "^", "#2a9d8f"),
    "symmetry_breaking": Mark("symmetry breaking", "D", "#9b5de5"),
    "cusp": Mark("cusp", "*", "#222222"),
    "generalised_doubling": Mark("generalised doubling", "p", "#e9c46a"),
    "resonance_1_1": Mark("1:1 resonance", "P", BEFORE),
    "resonance_1_2": Mark("1:2 resonance", "X", "#e9c46a"),
    "resonance_1_3": Mark("1:3 resonance", "v", "#2a9d8f"),
    "resonance_1_4": Mark("1:4 resonance", "d", "#2a9d8f"),
}
"""Every bifurcation and special point of curves of them, by the name of its kind."""


def mark_of(kind: str) -> Mark:
    """Give how a special point is drawn; an event of a branch by its own name."""
    return MARKS.get(kind, Mark(kind, "h", "#ffffff"))


def drive_words(excitation: str, symbol: str = "") -> str:
    """Give what an axis of drive amplitudes is called.

    Args:
        excitation: "force" or "base_acceleration", as of an `Isolator`.
        symbol: stands between name and unit.

    Returns:
        Such as "force amplitude [N]".
    """
    words = "force amplitude" if excitation == "force" else "amplitude of the base acceleration"
    return f"{words}{symbol and ' '}{symbol} [{drive_unit(excitation)}]"


def drive_unit(excitation: str) -> str:
    """Give the unit of the drive.

    Args:
        excitation: "force" or "base_acceleration".

    Returns:
        Such as "N".
    """
    return typeset_unit(DRIVE_UNITS[excitation])


def parameter_label(model: Isolator, parameter: str) -> str:
    """Give what an axis of a branch's parameter is called.

    Args:
        model: the isolator.
        parameter: "amplitude", "frequency" or the name of a coefficient.

    Returns:
        Such as "frequency [Hz]".
    """
    if parameter == "amplitude":
        return drive_words(model.excitation)
    if parameter == "frequency":
        return "frequency [Hz]"
    units = {entry.name: entry.spec.unit for entry in model.parameters}
    unit = typeset_unit(units.get(parameter, "1"))
    return f"{parameter.replace('_', ' ')}{f' [{unit}]' if unit else ''}"


def draw_curve(
    ax: Axes,
    x: Float[np.ndarray, " point"],
    y: Float[np.ndarray, " point"],
    stable: Bool[np.ndarray, " point"],
    colour: str,
    label: str = "",
) -> None:
    """Draw a curve of orbits, solid where both ends of a piece are stable and dashed elsewhere.

    Args:
        ax: the axes.
        x: along the curve; NaN interrupts it.
        y: along the curve.
        stable: whether each orbit is stable.
        colour: of the line.
        label: entry of the legend for its solid part.
    """
    stable = np.asarray(stable, dtype=bool)
    unstable = ~stable & np.isfinite(x) & np.isfinite(y)
    touched = unstable.copy()
    touched[1:] |= unstable[:-1]
    touched[:-1] |= unstable[1:]
    ax.plot(x, np.where(stable, y, np.nan), color=colour, linewidth=1.6, label=label or None)
    if unstable.any():
        ax.plot(x, np.where(touched, y, np.nan), color=colour, linewidth=1.3, linestyle=_DASHES)


def draw_special_points(
    ax: Axes,
    points: Iterable[tuple[SpecialPoint | CodimensionTwoPoint | str, float, float]],
    names: tuple[str | None, str | None] = (None, None),
) -> tuple[str, ...]:
    """Mark bifurcations, with their intervals where they have some.

    Args:
        ax: the axes.
        points: each, or its kind, with its place.
        names: what of a point's band lies along each axis; None for nothing.

    Returns:
        The kinds that were drawn.
    """
    found: dict[str, list[tuple[float, float]]] = {}
    for point, x, y in points:
        if np.isfinite(x) and np.isfinite(y):
            found.setdefault(point if isinstance(point, str) else point.kind, []).append((x, y))
            if not isinstance(point, str) and point.band is not None:
                _draw_interval(ax, (x, y), point.band, names)
    for kind, places in found.items():
        ax.plot(*np.transpose(places), zorder=5, **_form(mark_of(kind)))
    return tuple(found)


def _draw_interval(
    ax: Axes, place: tuple[float, float], band: Band, names: tuple[str | None, str | None]
) -> None:
    """Draw the interval of a special point along the axes that its band names."""
    sides = [
        None
        if name is None
        else [
            [abs(own - float(band.lower[name]))],
            [abs(float(band.upper[name]) - own)],
        ]
        for own, name in zip(place, names, strict=True)
    ]
    style = {"fmt": "none", "ecolor": "#222222", "elinewidth": 1.0, "capsize": 3.0, "zorder": 4}
    ax.errorbar(*place, xerr=sides[0], yerr=sides[1], **style)


def _form(mark: Mark) -> dict[str, Any]:
    return {
        "linestyle": "none",
        "marker": mark.marker,
        "markersize": 9 if mark.marker == "*" else 6,
        "markerfacecolor": mark.colour,
        "markeredgecolor": "#222222",
        "markeredgewidth": 0.8,
    }


def mark_handle(kind: str) -> Line2D:
    """Give the entry of a bifurcation in a legend."""
    mark = mark_of(kind)
    return Line2D([], [], label=mark.words, **_form(mark))


def stability_handles(
    ax: Axes, kinds: Iterable[str] = (), *, unstable: bool = True, extra: Iterable[Any] = ()
) -> list[Any]:
    """Give the entries of a legend: what is labelled, then what solid, dashed and the markers mean.

    Args:
        ax: the axes.
        kinds: bifurcations that were drawn.
        unstable: whether anything dashed was drawn.
        extra: more handles, after these.

    Returns:
        The handles.
    """
    handles, _ = ax.get_legend_handles_labels()
    grey = "#555555"
    handles.append(Line2D([], [], color=grey, linewidth=1.6, label="stable"))
    if unstable:
        handles.append(Line2D([], [], color=grey, linewidth=1.3, linestyle=_DASHES, label="unstable"))
    drawn = sorted(set(kinds), key=lambda kind: ([*MARKS, kind].index(kind), kind))
    handles += [mark_handle(kind) for kind in drawn]
    return [*handles, *extra]


def level_colours(count: int) -> tuple[str, ...]:
    """Give a colour for each of some curves, lowest level first."""
    return (AFTER,) if count == 1 else tuple(LEVELS[place % len(LEVELS)] for place in range(count))


def quantity(value: float, unit: str) -> str:
    """Give a number with its unit.

    Args:
        value: the number.
        unit: its unit.

    Returns:
        Such as "4.2 Hz".
    """
    return f"{float(value):.4g} {unit}".rstrip()
