"""Curves of periodic orbits: branches, frequency responses, the backbone, transmissibility."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from ...stability import BackboneCurve, Branch, FrequencyResponse, SpecialPoint, Transmissibility
from ._draw_band import draw_band
from ._stability_style import (
    MILLIMETRES,
    draw_curve,
    draw_special_points,
    drive_unit,
    level_colours,
    parameter_label,
    quantity,
    stability_handles,
)
from ._style import MEASURED, NEUTRAL, axes_for, entitle


def plot_branch(branch: Branch, *, others: Sequence[Branch] = (), ax: Axes | None = None) -> Figure:
    """Draw the response along a branch, solid where stable, with its bifurcations.

    The branches that were found beside it (`branch.others`) are drawn with it, each in a colour of its own.

    Args:
        branch: one or a batch.
        others: more of the same parameter, such as those that `switch_branch` gives.
        ax: axes to draw on.

    Returns:
        The figure.

    Raises:
        ValueError: if the branches follow different parameters.
    """
    for other in others:
        if other.parameter != branch.parameter:
            raise ValueError(
                f"Argument `others` must follow {branch.parameter!r}, but one follows {other.parameter!r}."
            )
    figure, ax = axes_for(ax, 6.4, 3.8)
    kinds: set[str] = set()
    beside = [other for one in (branch, *others) for other in one.others]
    curves = [(one, place) for one in (branch, *others, *beside) for place in range(_motion_count(one))]
    unstable = False
    for (one, place), colour in zip(curves, level_colours(len(curves)), strict=True):
        points = one.points
        x, y, stable = (
            _row(np.asarray(values), place) for values in (points.value, points.response, points.stable)
        )
        unstable |= _any_unstable(y, stable)
        label = _beside_words(one) if any(one is other for other in beside) else _level(one, place)
        draw_curve(ax, x, MILLIMETRES * y, stable, colour, label if len(curves) > 1 else "")
        draw_branch_band(ax, one, place, colour)
    for one in (branch, *others, *beside):
        marked = [_placed(one, point) for point in one.special_points]
        kinds |= set(draw_special_points(ax, marked, ("value", None)))
    ax.set_xlabel(parameter_label(branch.model, branch.parameter))
    ax.set_ylabel("response, half peak to peak [mm]")
    title = "Periodic response" + (f" at {_level(branch, 0)}" if len(curves) == 1 else "")
    title += _missing_words([branch, *others, *beside])
    entitle(ax, title, stability_handles(ax, kinds, unstable=unstable))
    return figure


def plot_frequency_response(
    response: FrequencyResponse,
    *,
    backbone: BackboneCurve | None = None,
    what: Literal["displacement", "phase"] = "displacement",
    ax: Axes | None = None,
) -> Figure:
    """Draw the response over frequency, past its folds, solid where stable.

    Responses beside the curve (`response.others`) are drawn with it, each in a colour of its own; the legend
    says what they are.

    Args:
        response: at one drive amplitude or several.
        backbone: drawn through the peaks of the displacement.
        what: the displacement, or the phase of its fundamental after the drive.
        ax: axes to draw on.

    Returns:
        The figure.

    Raises:
        ValueError: if `what` is neither.
    """
    if what not in ("displacement", "phase"):
        raise ValueError(f'Argument `what` must be "displacement" or "phase", but is {what!r}.')
    figure, ax = axes_for(ax, 6.4, 3.8)
    drives, unstable, places = _motion_count(response.branch), False, []
    curves = [(response, place) for place in range(drives)] + [(other, 0) for other in response.others]
    for number, ((one, place), colour) in enumerate(zip(curves, level_colours(len(curves)), strict=True)):
        heights = MILLIMETRES * np.asarray(one.amplitude)
        heights = heights if what == "displacement" else np.degrees(np.asarray(one.phase))
        x, y, stable = (_row(np.asarray(v), place) for v in (one.frequency, heights, one.stable))
        unstable |= _any_unstable(y, stable)
        words = _level(one.branch, place)
        if number >= drives:
            words = _beside_words(one.branch) + (f", {words}" if drives > 1 else "")
        draw_curve(ax, x, y, stable, colour, words)
        if what == "displacement":
            draw_branch_band(ax, one.branch, place, colour)
        for point in one.special_points:
            if point.branch == place:
                nearest = _nearest_point(one.branch, place, point)
                height = MILLIMETRES * nearest[1] if what == "displacement" else y[nearest[0]]
                places.append((point, float(point.frequency), float(height)))
    kinds = draw_special_points(ax, places, ("frequency", None))
    extra = _draw_backbone(ax, backbone) if backbone is not None and what == "displacement" else []
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel(
        "response, half peak to peak [mm]" if what == "displacement" else "phase after the drive [°]"
    )
    title = "Frequency response" + _missing_words([response.branch, *(one.branch for one in response.others)])
    entitle(ax, title, stability_handles(ax, kinds, unstable=unstable, extra=extra))
    return figure


def plot_backbone(backbone: BackboneCurve, *, ax: Axes | None = None) -> Figure:
    """Draw how free vibration and phase resonance move with the displacement.

    Args:
        backbone: the curve.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax, 5.6, 4.0)
    handles = [*_draw_backbone(ax, backbone), *ax.get_legend_handles_labels()[0]]
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel("largest displacement [mm]")
    ax.set_ylim(bottom=0.0)
    missing = int(np.sum(~np.isfinite(np.asarray(backbone.frequency))))
    note = f"\nphase resonance not found at {missing} of {backbone.frequency.size} points" if missing else ""
    entitle(ax, f"Backbone{note}", handles)
    return figure


def plot_transmissibility(transmissibility: Transmissibility, *, ax: Axes | None = None) -> Figure:
    """Draw what passes through the isolator, solid where the orbit is stable.

    Args:
        transmissibility: with one orbit a frequency, or several.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax, 6.4, 3.8)
    frequency = np.asarray(transmissibility.frequencies)
    ratio = np.atleast_2d(np.asarray(transmissibility.magnitude))
    stable = np.atleast_2d(np.asarray(transmissibility.stable))
    unstable = False
    for thread in threads(ratio, stable):
        x, y, held = frequency[thread[1]], ratio[thread], stable[thread]
        unstable |= _any_unstable(y, held)
        draw_curve(ax, x, y, held, level_colours(1)[0])
    if transmissibility.band is not None:
        ends = (transmissibility.band.lower, transmissibility.band.upper)
        lower, upper = (np.atleast_2d(np.asarray(end["magnitude"])) for end in ends)
        for low, high in zip(lower, upper, strict=True):
            # An interval that reaches zero has no lower end on a logarithmic axis: it is drawn a decade down.
            low = np.maximum(low, 0.1 * high)
            draw_band(ax, (frequency, low), (frequency, high), level_colours(1)[0])
    ax.axhline(1.0, color=MEASURED, linewidth=0.8, linestyle=":")
    ax.set_yscale("log")
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    ax.yaxis.set_minor_formatter(NullFormatter())
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel("transmissibility [1]")
    title = "Transmissibility of the fundamental; isolates below 1"
    entitle(ax, title, stability_handles(ax, unstable=unstable))
    return figure


def threads(
    values: Float[np.ndarray, "orbit frequency"],
    stable: Bool[np.ndarray, "orbit frequency"],
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Give coexisting orbits as curves; where their number changes, one goes on into the nearest.

    Args:
        values: of each orbit, by rising size; NaN where there is none.
        stable: whether it is stable.

    Returns:
        Places of the orbit and of the frequency along each curve.
    """
    count = np.sum(np.isfinite(values), axis=0)
    breaks = np.flatnonzero(np.diff(count)) + 1
    curves = []
    for columns in np.split(np.arange(count.size), breaks):
        for orbit in range(int(count[columns[0]])):
            curves.append((np.full_like(columns, orbit), columns))
    for place in breaks:
        few, many = (place - 1, place) if count[place - 1] < count[place] else (place, place - 1)
        left = list(range(int(count[many])))
        for orbit in range(int(count[few])):
            near = min(
                (place for place in left if stable[place, many] == stable[orbit, few]),
                key=lambda place: abs(np.log(values[place, many] / values[orbit, few])),
                default=None,
            )
            if near is None:
                continue
            left.remove(near)
            curves.append((np.array([orbit, near]), np.array([few, many])))
        # Orbits without a partner meet in a fold between the two frequencies.
        for one, other in zip(left[::2], left[1::2], strict=False):
            curves.append((np.array([one, other]), np.array([many, many])))
    return curves


def _draw_backbone(ax: Axes, backbone: BackboneCurve) -> list[Line2D]:
    """Draw both curves; free vibration is wide and pale, so that it shows beneath the other."""
    height = MILLIMETRES * np.asarray(backbone.displacements)
    free = {"color": NEUTRAL, "linewidth": 3.5, "alpha": 0.7}
    forced = {"color": MEASURED, "linewidth": 1.2, "linestyle": "-."}
    ax.plot(np.asarray(backbone.natural_frequency), height, **free)
    ax.plot(np.asarray(backbone.frequency), height, **forced)
    if backbone.band is not None:
        ends = (backbone.band.lower, backbone.band.upper)
        lower, upper = ((np.asarray(end["frequency"]), height) for end in ends)
        draw_band(ax, lower, upper, MEASURED)
    return [
        Line2D([], [], label="free vibration, no damping", **free),
        Line2D([], [], label="phase resonance", **forced),
    ]


def draw_branch_band(ax: Axes, branch: Branch, place: int, colour: str) -> None:
    """Draw how far a branch may be off, where a fit was given.

    Args:
        ax: axes to draw on.
        branch: one or a batch.
        place: which of a batch.
        colour: of its curve.
    """
    if branch.band is not None:
        lower, upper = (
            (_row(np.asarray(end["value"]), place), MILLIMETRES * _row(np.asarray(end["response"]), place))
            for end in (branch.band.lower, branch.band.upper)
        )
        draw_band(ax, lower, upper, colour)


def _motion_count(branch: Branch) -> int:
    return branch.points.value.shape[0] if branch.points.value.ndim == 2 else 1


def _row(values: np.ndarray, place: int) -> np.ndarray:
    return values[place] if values.ndim == 2 else values


def _any_unstable(values: np.ndarray, stable: np.ndarray) -> bool:
    return bool(np.any(np.isfinite(values) & ~np.asarray(stable, dtype=bool)))


def _level(branch: Branch, place: int) -> str:
    """Give what is held fixed along a branch."""
    unit = drive_unit(branch.model.excitation)
    # Of the family: a branch that found no orbit has no points to read it from.
    held = {"amplitude": (branch.family.amplitude, unit), "frequency": (branch.family.frequency, "Hz")}
    held.pop(branch.parameter, None)
    words = [quantity(float(np.ravel(values)[place]), own) for values, own in held.values()]
    return ", ".join(words) + (f", period {branch.periods}" if branch.periods > 1 else "")


def _beside_words(branch: Branch) -> str:
    """Say what a branch beside another is, for the legend."""
    how = {"none": "detached", "bifurcation": "from a bifurcation", "unknown": "not reached by the curve"}
    return how[branch.connection] + (f", {branch.periods} drive periods" if branch.periods > 1 else "")


def _missing_words(branches: Sequence[Branch]) -> str:
    """Say below the title what the curves lack of their range, and what of them is in doubt."""
    words = [one.missing_part for one in branches]
    bent = [one.band.curved_part for one in branches if one.band is not None]
    words += [f"band {one}, and rough there" for one in bent if one]
    words += [f"possible {point.in_doubt}" for one in branches for point in one.possible_points]
    words += [one.undecided_part for one in branches]
    return "".join(f"\n{one}" for one in dict.fromkeys(words) if one)


def _nearest_point(branch: Branch, place: int, point: SpecialPoint) -> tuple[int, float]:
    """Give the point of a branch that is nearest to a bifurcation, and the response in between."""
    states = (
        np.asarray(branch.points.y0) if branch.points.y0.ndim == 2 else np.asarray(branch.points.y0[place])
    )
    value, response = (_row(np.asarray(v), place) for v in (branch.points.value, branch.points.response))
    size = np.maximum(np.nanmax(np.abs(states), axis=0), np.finfo(float).tiny)
    span = max(float(np.ptp(value[np.isfinite(value)])), np.finfo(float).tiny)
    away = np.concatenate(
        [(states - np.asarray(point.y0)) / size, (value - float(point.value))[:, None] / span], axis=1
    )
    distance = np.linalg.norm(np.where(np.isfinite(away), away, np.inf), axis=1)
    if not np.isfinite(distance).any():
        return 0, float("nan")
    first, second = np.argsort(distance)[:2]
    total = distance[first] + distance[second]
    share = distance[first] / total if total > 0.0 else 0.0
    return int(first), float(response[first] + share * (response[second] - response[first]))


def _placed(branch: Branch, point: SpecialPoint) -> tuple[SpecialPoint, float, float]:
    _, response = _nearest_point(branch, point.branch, point)
    return point, float(point.value), MILLIMETRES * response
