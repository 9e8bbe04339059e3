"""Equivalent stiffness and damping at resonance, their polynomial fits, the laws that follow."""

import dataclasses
from typing import Literal

import numpy as np
from jaxtyping import Float

from ..._show import shown
from ._circle_fit import CircleFit, fit_circle
from ._equivalent_coefficients import invert_equivalent
from ._half_power import HalfPower, find_half_power, find_jumps, find_phase_resonance
from ._measured_receptance import MeasuredResponse


@shown
@dataclasses.dataclass(frozen=True)
class MeasuredResonance:
    """Equivalent stiffness and damping of one record at its resonance.

    Attributes:
        record: name of the record.
        level: declared level, or None.
        direction: "forward", "backward" or "none".
        half_power: peak, half-power points and damping ratio of the receptance.
        phase_resonance: where the displacement lags the force by 90 degrees [Hz]; NaN where the sweep has
            none.
        circle: circle through the mobility.
        amplitude: displacement amplitude X at the peak [m].
        frequency: resonance frequency that was used, omega_r/(2 pi) [Hz]; NaN where there is none.
        damping_ratio: damping ratio that was used [1]; NaN where there is none.
        stiffness: K_eq = m omega_r^2 [N/m].
        damping: C_eq = 2 zeta omega_r m [N s/m].

    Source: the paper, eq. (9) and the expressions for K_eq and C_eq after Figs. 10 and 12.
    """

    record: str
    level: float | None
    direction: str
    half_power: HalfPower
    phase_resonance: float
    circle: CircleFit
    amplitude: float
    frequency: float
    damping_ratio: float
    stiffness: float
    damping: float


def measured_resonance(
    response: MeasuredResponse,
    mass: float,
    damping: Literal["half_power", "circle"] = "half_power",
    resonance: Literal["peak", "phase"] = "peak",
) -> MeasuredResonance | None:
    """Find resonance, equivalent stiffness and equivalent damping of one record.

    Args:
        response: measured receptance of the record.
        mass: moving mass [kg].
        damping: where the damping ratio comes from.
        resonance: which resonance K_eq comes from: the largest receptance, as the paper, or a lag of 90
            degrees, which is exact where damping is not small.

    Returns:
        The resonance; None with fewer than three lines.
    """
    frequency, first = np.unique(response.frequency, return_index=True)
    if frequency.size < 3:
        return None
    receptance = response.receptance[first]
    half_power = find_half_power(frequency, receptance, find_jumps(frequency, receptance, mass))
    circle = fit_circle(frequency, receptance)
    phase_resonance = find_phase_resonance(frequency, receptance)
    peak = half_power.peak_frequency if half_power.peak_inside else float("nan")
    used = peak if resonance == "peak" else phase_resonance
    ratio = half_power.damping_ratio if damping == "half_power" else circle.damping_ratio
    at = used if np.isfinite(used) else half_power.peak_frequency
    omega = 2 * np.pi * used
    return MeasuredResonance(
        record=response.record,
        level=response.level,
        direction=response.direction,
        half_power=half_power,
        phase_resonance=phase_resonance,
        circle=circle,
        amplitude=float(np.interp(at, frequency, np.abs(response.displacement[first, 0]))),
        frequency=used,
        damping_ratio=ratio,
        stiffness=mass * omega**2,
        damping=2.0 * ratio * omega * mass,
    )


@shown
@dataclasses.dataclass(frozen=True, eq=False)
class EquivalentLaw:
    """Equivalent stiffness or damping as polynomials of the amplitude, by sweep direction, and their average.

    Attributes:
        directions: sweep directions that gave points.
        polynomials: coefficients of 1, S, S^2, by direction [N/m or N s/m over powers of m or m/s].
        average: mean over the directions.
        law: coefficients of s, |s|s, s^3 that belong to the average.
        points: amplitude S and equivalent coefficient, by direction.

    Source: the paper, eqs. (10)-(13), (15)-(18), (20)-(23), (25)-(28).
    """

    directions: tuple[str, ...]
    polynomials: Float[np.ndarray, "direction power"]
    average: Float[np.ndarray, " power"]
    law: Float[np.ndarray, " power"]
    points: tuple[Float[np.ndarray, "_ 2"], ...]


def average_law(
    polynomials: Float[np.ndarray, "direction power"],
    directions: tuple[str, ...] = ("forward", "backward"),
    points: tuple[Float[np.ndarray, "_ 2"], ...] = (),
) -> EquivalentLaw:
    """Average polynomials over the sweep directions and invert them to a force law.

    Args:
        polynomials: coefficients of 1, S, S^2, by direction.
        directions: their names.
        points: the points that they were fitted to.

    Returns:
        Polynomials, average, law.

    Source: the paper, eqs. (12)-(13).
    """
    average = np.mean(polynomials, axis=0)
    return EquivalentLaw(directions, polynomials, average, invert_equivalent(average), points)


_REPEATED = 0.03
"""Relative difference of two amplitudes up to which they repeat each other."""


def _distinct(amplitude: Float[np.ndarray, " point"]) -> int:
    """Count amplitudes that differ by more than their repeats do."""
    ordered = np.sort(amplitude)
    return 1 + int(np.count_nonzero(np.diff(ordered) > _REPEATED * ordered[1:])) if ordered.size else 0


def fit_equivalent_law(
    points: dict[str, Float[np.ndarray, "_ 2"]], what: str, order: int = 2
) -> tuple[EquivalentLaw | None, tuple[str, ...]]:
    """Fit equivalent coefficients over amplitude, each sweep direction by itself, then average.

    Args:
        points: amplitude S and equivalent coefficient, by direction; rows with NaN do not count.
        what: "stiffness" or "damping", for the notes.
        order: highest power of the amplitude.

    Returns:
        The law, or None where no point is usable; and a sentence for each limitation of the points.

    Source: the paper, eqs. (10)-(13).
    """
    usable = {name: rows[np.all(np.isfinite(rows), axis=1)] for name, rows in points.items()}
    usable = {name: rows for name, rows in usable.items() if rows.shape[0]}
    if not usable:
        return None, (f"No record has a usable resonance for the equivalent {what}.",)
    notes: dict[str, list[str]] = {}
    polynomials = []
    for name, rows in usable.items():
        levels = _distinct(rows[:, 0])
        reached = min(order, levels - 1)
        shape = ("constant", "straight line", "quadratic")[reached]
        if reached < order:
            notes.setdefault(f"{levels} distinct amplitudes allow no more than a {shape}.", []).append(name)
        elif levels == order + 1:
            note = f"{levels} distinct amplitudes determine the {shape} exactly: its error remains unknown."
            notes.setdefault(note, []).append(name)
        scale = float(np.max(rows[:, 0]))
        fitted = np.polynomial.polynomial.polyfit(rows[:, 0] / scale, rows[:, 1], reached)
        polynomials.append(np.pad(fitted / scale ** np.arange(reached + 1), (0, order - reached)))
    law = average_law(np.stack(polynomials), tuple(usable), tuple(usable.values()))
    return law, tuple(f"Equivalent {what}, {' and '.join(names)}: {note}" for note, names in notes.items())
