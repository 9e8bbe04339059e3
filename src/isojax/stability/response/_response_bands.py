"""Response and transmissibility over frequency at several amplitudes, with bands, off one grid of orbits.

The grid lies over displacement and frequency, where orbits do not fold. A response curve is a contour of the
drive amplitude on it; the error of the coefficients moves the contour across itself. A fold is a place where
the drive does not change with the displacement. There the curve moves along the frequency only, so that its
error is that of the drive over its slope by the frequency.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import contourpy
import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import RectBivariateSpline
from scipy.ndimage import distance_transform_edt

from ..._show import amount, number, shown
from ..._types import check_float64
from ...models import (
    HALF_WIDTH,
    Band,
    EndsEstimated,
    Estimated,
    Integrator,
    Isolator,
    band_across,
    coefficient_errors,
    existence,
)
from ..orbit import ascending, integrator_for, margin_beside_folds
from ._imposed_motion import ImposedMotions, impose_motions

_STEPS = 64, 256
"""Steps a period where none are asked for, and where these do not find every orbit."""

_FEW_LOST = 0.05
"""Share of the orbits that may be lost without other steps: some do not exist, as past a snap-through."""

_GRID_FREQUENCIES = 25
"""Frequencies of the grid."""

_FINE = 800, 300
"""Frequencies and displacements among which contours are sought, so that they resolve light damping."""

_DRAWN = 200, 300
"""Frequencies and displacements among which folds of drawn models are counted."""

_DRAWS, _SEED = 400, 0
"""Models drawn for that."""

_FEWEST_OF_CONTOUR = 3
"""Points of a contour that is kept."""

_NAMES = ("displacement", "transmissibility")

_POLISHING = 2
"""Steps of Newton's method from a contour between points to the contour of the splines."""


@shown
class CurveFold(NamedTuple):
    """A fold of a response curve: where two orbits of it meet and vanish.

    Attributes:
        frequency: [Hz].
        displacement: amplitude of the fundamental [m].
        transmissibility: of the fundamental.
        interval: lower and upper end of the frequency, as far as the coefficients are known [Hz].
    """

    frequency: float
    displacement: float
    transmissibility: float
    interval: tuple[float, float]


@shown
class ResponseCurve(NamedTuple):
    """One piece of the response at one drive amplitude, in the order of the curve.

    Attributes:
        amplitude: of the recorded drive [N, or m/s^2 for base excitation].
        frequency: along the curve; goes back where the response folds [Hz].
        displacement: amplitude of the fundamental [m].
        transmissibility: of the fundamental: force on the ground over the force that acts, or absolute motion
            over that of the base.
        stable: whether each orbit is stable.
        standard_error: of "displacement" and "transmissibility" at the same frequency; infinite at a fold.
        displacement_band: of frequency and displacement, across the curve.
        transmissibility_band: of frequency and transmissibility, across the curve.
        folds: in the order of the curve.
    """

    amplitude: float
    frequency: Float[np.ndarray, " point"]
    displacement: Float[np.ndarray, " point"]
    transmissibility: Float[np.ndarray, " point"]
    stable: Bool[np.ndarray, " point"]
    standard_error: Mapping[str, Float[np.ndarray, " point"]]
    displacement_band: Band
    transmissibility_band: Band
    folds: tuple[CurveFold, ...]


@shown
class ResponseBands(NamedTuple):
    """Sine responses of a fitted model over frequency, with their bands.

    Attributes:
        model: the isolator.
        amplitudes: of the recorded drive [N, or m/s^2 for base excitation].
        frequencies: lowest and highest [Hz].
        curves: by drive amplitude; several where a response is detached, or leaves the band of frequencies.
        lost: share of the orbits of the grid that were not found; the curves have gaps there.
        fold_probability: of each amplitude, that the response folds between the frequencies: the share of
            models drawn from the fit whose response does.
        fold_probability_error: standard error of that share, by the count of models.
    """

    model: Isolator
    amplitudes: tuple[float, ...]
    frequencies: tuple[float, float]
    curves: tuple[ResponseCurve, ...]
    lost: float
    fold_probability: tuple[float, ...]
    fold_probability_error: tuple[float, ...]

    def _headline(self) -> str:
        folds = sum(len(one.folds) for one in self.curves)
        largest = max((float(one.displacement.max()) for one in self.curves), default=np.nan)
        levels = ", ".join(number(one) for one in self.amplitudes)
        return f"drives of {levels}: largest displacement {amount(largest, 'm')}, {folds} folds"


def response_bands(
    fit: Estimated | EndsEstimated,
    amplitudes: Any,
    frequencies: Any,
    *,
    integrator: Integrator | None = None,
) -> ResponseBands:
    """Give response and transmissibility over frequency at several drive amplitudes, with their bands.

    All of them come off one grid of orbits, within seconds, coefficients' errors included: to the accuracy of
    a picture, about a thousandth. `frequency_response` and `transmissibility` follow one curve exactly.
    Motions that repeat after more than one drive period are not sought. Where the band of frequencies holds a
    narrow resonance of a higher harmonic, the grid may pass it over.

    Args:
        fit: a fit, a saved one, or what ends with one.
        amplitudes: of the drive, ascending [N, or m/s^2 for base excitation].
        frequencies: of which the first and the last bound the curves [Hz].
        integrator: solver and steps; 64 a period if omitted, times what sharp laws ask for,
            and more where these do not find every orbit.

    Returns:
        The curves.

    Raises:
        ValueError: if the fit failed, leaves a coefficient undetermined or is at no one pressure or
            temperature although its model follows it, the amplitudes or frequencies are
            not positive or do not ascend, or there are no two frequencies.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Carrella et al. 2012, Int. J. Mech. Sci. 55:22 (force and displacement, nonlinear isolators);
        implicit function theorem for the band.

    Example:
        With the fit of `fit`'s example:

        >>> found = ij.response_bands(fitted, [20.0, 60.0], (4.0, 7.0))
        >>> [f"{curve.amplitude:.0f} N, {len(curve.folds)} folds" for curve in found.curves]
        ['20 N, 0 folds', '60 N, 0 folds']
    """
    check_float64()
    errors = coefficient_errors(fit)
    if errors.model.conditions:
        given = ", ".join(f"{name}=..." for name in errors.model.conditions)
        raise ValueError(
            f"Argument `fit` must be at one {' and '.join(errors.model.conditions)}, which a coefficient "
            f"follows, such as isojax.fit_at(fit, {given})."
        )
    forces, ends = (
        ascending(name, np.asarray(values, dtype=float))
        for name, values in (("amplitudes", amplitudes), ("frequencies", frequencies))
    )
    if ends.size < 2:
        raise ValueError(f"Argument `frequencies` must hold two different ones, but is {frequencies}.")
    nodes = np.geomspace(ends[0], ends[-1], _GRID_FREQUENCIES)
    steps = _STEPS if integrator is None else _STEPS[:1]
    tries = [integrator_for(errors.model, integrator, count) for count in steps]
    motions = impose_motions(errors, forces, nodes, tries[0])
    for finer in tries[1:]:
        # Where steps are too long for a stiff law, there are no orbits.
        if np.mean(motions.closed) < 1.0 - _FEW_LOST:
            motions = impose_motions(errors, forces, nodes, finer)
    surface = _Surface(motions)
    curves = tuple(curve for force in forces for curve in surface.curves(float(force)))
    lost = 1.0 - float(np.mean(motions.closed))
    band = float(ends[0]), float(ends[-1])
    chances = surface.fold_probabilities(forces, errors.draw(_DRAWS, _SEED))
    return ResponseBands(errors.model, tuple(map(float, forces)), band, curves, lost, *chances)


class _Size(NamedTuple):
    """The logarithm of an amplitude at points of the surface.

    Attributes:
        value: itself.
        slopes: by the logarithms of frequency and displacement.
        change: by each independent step of the covariance, at the same frequency and displacement.
    """

    value: Float[np.ndarray, " point"]
    slopes: Float[np.ndarray, "2 point"]
    change: Float[np.ndarray, "step point"]

    def over(self, other: "_Size") -> "_Size":
        """Give the logarithm of the ratio of both amplitudes."""
        return _Size(*(own - its for own, its in zip(self, other, strict=True)))

    def moved(self, by: Float[np.ndarray, "step 2 point"]) -> Float[np.ndarray, "step point"]:
        """Give its change by each step where the points move too."""
        return self.change + np.sum(self.slopes * by, axis=1)


class _Surface:
    """Splines over the logarithms of frequency and displacement."""

    def __init__(self, motions: ImposedMotions):
        """Fit them to the nodes."""
        self.axes = np.log(motions.frequencies), np.log(motions.displacements)
        values, changes = motions.fundamentals, motions.changes
        if not motions.closed.all() and motions.closed.any():
            # One node without numbers would spoil the splines. No contour goes where its neighbour stands in.
            nearest = distance_transform_edt(~motions.closed, return_distances=False, return_indices=True)
            values, changes = (one[..., *np.asarray(nearest)] for one in (values, changes))
        self.known = self._spline(motions.closed.astype(float), 1)
        self.margin = self._spline(self._margins(motions, values[0]), 1)
        self.tables = [
            [self._spline(part) for table in (value, *change) for part in (table.real, table.imag)]
            for value, change in zip(values, changes, strict=True)
        ]

    def _spline(self, table: Float[np.ndarray, "frequency displacement"], degree: int = 3) -> Any:
        return RectBivariateSpline(*self.axes, table, kx=degree, ky=degree)

    def _margins(self, motions: ImposedMotions, drive: np.ndarray) -> np.ndarray:
        """Give how far each node is from any loss of stability but a fold; negative where it is lost."""
        roots = motions.multipliers
        margin = margin_beside_folds(roots)
        rises = np.gradient(np.log(np.abs(drive)) + self.axes[1], self.axes[1], axis=1) > 0.0
        # What is unstable though neither says so, such as where two multipliers left through one point.
        left = rises & (np.max(np.abs(roots), axis=-1) >= 1.0)
        return np.where(left, -np.abs(margin), margin)

    def _size(self, which: int, at: Float[np.ndarray, "2 point"]) -> _Size:
        """Give the amplitude of a fundamental."""
        real, imaginary, *moves = self.tables[which]

        def read(order: tuple[int, int]) -> np.ndarray:
            return real.ev(*at, *order) + 1j * imaginary.ev(*at, *order)

        value = read((0, 0))
        slopes = np.array([read((1, 0)), read((0, 1))])
        pairs = zip(moves[::2], moves[1::2], strict=True)
        change = np.array([own.ev(*at) + 1j * other.ev(*at) for own, other in pairs]).reshape(-1, value.size)
        size = _Size(np.log(np.abs(value)), (slopes / value).real, (change / value).real)
        return size._replace(value=size.value + at[1], slopes=size.slopes + np.array([[0.0], [1.0]]))

    def curves(self, amplitude: float) -> list[ResponseCurve]:
        """Give the response curves at a drive amplitude."""
        fine = [np.linspace(axis[0], axis[-1], count) for axis, count in zip(self.axes, _FINE, strict=True)]
        drive = np.hypot(*(part(*fine) for part in self.tables[0][:2]))
        height = np.log(drive) + fine[1][None] - np.log(amplitude)
        height = np.ma.masked_where(self.known(*fine) < 0.999, height)
        lines = contourpy.contour_generator(fine[0], fine[1], height.T).lines(0.0)
        return [
            self._curve(amplitude, np.asarray(line).T) for line in lines if len(line) >= _FEWEST_OF_CONTOUR
        ]

    def fold_probabilities(
        self, amplitudes: Float[np.ndarray, " level"], draws: Float[np.ndarray, "draw step"]
    ) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Give the share of drawn models whose response folds at each amplitude, and its standard error.

        At an imposed motion the drive goes with the coefficients to first order. Where it falls as the
        displacement grows, there are further orbits under drives of these amplitudes.
        """
        fine = [np.linspace(axis[0], axis[-1], count) for axis, count in zip(self.axes, _DRAWN, strict=True)]
        parts = np.array([part(*fine) for part in self.tables[0]])
        tables = parts[::2] + 1j * parts[1::2]
        known = self.known(*fine) >= 0.999
        known = known[:, :-1] & known[:, 1:]
        folds = np.full((len(draws), len(amplitudes)), np.nan)
        for row, steps in zip(folds, draws, strict=True):
            drive = np.abs(tables[0] + np.tensordot(steps, tables[1:], axes=1))
            low, high = _falling(np.log(drive) + fine[1], known)
            inside = (low[:, None] < np.log(amplitudes)) & (np.log(amplitudes) < high[:, None])
            row[inside.any(axis=0)] = 1.0
        share, error = existence(folds)
        return tuple(share.tolist()), tuple(error.tolist())

    def _curve(self, amplitude: float, at: Float[np.ndarray, "2 point"]) -> ResponseCurve:
        for _ in range(_POLISHING):
            drive = self._size(0, at)
            away = (drive.value - np.log(amplitude)) / np.sum(drive.slopes**2, axis=0)
            at = at - drive.slopes * away
        drive, acted, displacement, passed = (self._size(which, at) for which in range(len(self.tables)))
        ratio = passed.over(acted)
        frequency, sizes = np.exp(at[0]), (np.exp(displacement.value), np.exp(ratio.value))
        # A contour moves across itself, along the slope of what it is a contour of.
        across = -drive.change[:, None] * drive.slopes / np.sum(drive.slopes**2, axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            up = -drive.change / drive.slopes[1]
        up = np.stack([0.0 * up, up], axis=1)
        bands, errors = [], {}
        for name, one, size in zip(_NAMES, (displacement, ratio), sizes, strict=True):
            change = np.array([frequency * across[:, 0], size * one.moved(across)])
            values, change = np.array([frequency, size]), np.moveaxis(change, 1, 2)
            bands.append(band_across(("frequency", name), values, change))
            errors[name] = size * np.linalg.norm(one.moved(up), axis=0)
        stable = (drive.slopes[1] > 0.0) & (self.margin.ev(*at) > 0.0)
        folds = self._folds(at, drive.slopes[1])
        return ResponseCurve(
            amplitude, frequency, sizes[0], sizes[1], stable, errors, bands[0], bands[1], folds
        )

    def _folds(
        self, at: Float[np.ndarray, "2 point"], rise: Float[np.ndarray, " point"]
    ) -> tuple[CurveFold, ...]:
        """Give the folds: between two points of a contour, where the drive ceases to rise or to fall."""
        turns = np.flatnonzero(rise[:-1] * rise[1:] < 0.0)
        if not turns.size:
            return ()
        share = rise[turns] / (rise[turns] - rise[turns + 1])
        places = at[:, turns] + share * (at[:, turns + 1] - at[:, turns])
        drive, acted, displacement, passed = (self._size(which, places) for which in range(len(self.tables)))
        error = np.linalg.norm(drive.change, axis=0) / np.abs(drive.slopes[0])
        reach = np.exp(HALF_WIDTH * error)
        frequency, size, ratio = np.exp([places[0], displacement.value, passed.over(acted).value])
        columns = (frequency, size, ratio, frequency / reach, frequency * reach)
        return tuple(
            CurveFold(middle, height, share, (low, high))
            for middle, height, share, low, high in np.transpose(columns).tolist()
        )


def _falling(
    height: Float[np.ndarray, "frequency displacement"], known: Bool[np.ndarray, "frequency piece"]
) -> tuple[Float[np.ndarray, " gap"], Float[np.ndarray, " gap"]]:
    """Give between which heights a surface falls along displacement, from each frequency to the next.

    Args:
        height: at the nodes.
        known: between which displacements it is known.

    Returns:
        The least and the largest; infinite the wrong way round where it rises throughout.
    """
    middle = 0.5 * (height[:, :-1] + height[:, 1:])
    slope = np.where(known, np.diff(height, axis=1), np.inf)
    falls = slope < 0.0
    low = np.min(np.where(falls, height[:, 1:], np.inf), axis=1)
    high = np.max(np.where(falls, height[:, :-1], -np.inf), axis=1)
    # The falling part begins between two frequencies where the least slope passes zero.
    steepest = np.argmin(slope, axis=1)
    rows = np.arange(len(height))
    least, there = slope[rows, steepest], middle[rows, steepest]
    least = np.where(np.isfinite(least), least, 0.0)
    begins = least[:-1] * least[1:] < 0.0
    share = least[:-1] / np.where(begins, least[:-1] - least[1:], 1.0)
    tip = there[:-1] + share * (there[1:] - there[:-1])
    low = np.minimum(np.minimum(low[:-1], low[1:]), np.where(begins, tip, np.inf))
    high = np.maximum(np.maximum(high[:-1], high[1:]), np.where(begins, tip, -np.inf))
    return low, high
