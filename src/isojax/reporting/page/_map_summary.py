"""What a stability map says, in a few lines for the terminal."""

from collections.abc import Mapping

import numpy as np

from ...stability import FoldCurve, StabilityMap
from ...stability.map import chance_words, elsewhere_words, incomplete_words, unconfirmed_words
from ..plots import drive_unit, quantity
from ._map_files import result_codes

_REASONS = {1: "not converged", 2: "left every bound", 3: "multipliers not accurate", 4: "held by friction"}


def map_summary(
    smap: StabilityMap,
    *,
    folds: FoldCurve | None = None,
    seconds: Mapping[str, tuple[float, float]] | None = None,
    whose: str = "",
) -> str:
    """Give what a map says: its grid, the orbits, where they are unstable or several, errors, time.

    Args:
        smap: the map.
        folds: around cells with several orbits.
        seconds: of each part of the work, compiling and running [s].
        whose: errors the chances are made of, such as "of the mean over all records".

    Returns:
        The lines.
    """
    unit = drive_unit(smap.model.excitation)
    amplitudes, frequencies = np.asarray(smap.amplitudes), np.asarray(smap.frequencies)
    count, radius = np.asarray(smap.count), np.asarray(smap.spectral_radius)
    several, coexisting = count > 1, radius.ndim == 3
    layers = radius if coexisting else radius[None]
    worst = np.fmax.reduce(layers, axis=0)
    lines = [
        (
            "grid",
            f"{amplitudes.size} amplitudes {_span(amplitudes, unit)}, "
            f"{frequencies.size} frequencies {_span(frequencies, 'Hz')}",
        ),
        ("orbits", f"{count.sum()} in {count.size} cells; {_scope(smap)}"),
    ]
    if count.any():
        unstable = np.any(layers >= 1.0, axis=0)
        lines.append(("unstable", f"{_cells_holding(unstable)} an unstable orbit{_where(smap, unstable)}"))
        lines.append(("coexisting", _coexisting_words(smap, several, coexisting)))
        row, column = np.unravel_index(int(np.nanargmax(worst)), worst.shape)
        place = f"{quantity(amplitudes[row], unit)}, {quantity(frequencies[column], 'Hz')}"
        lines.append(("largest |µ|", f"{worst[row, column]:.4f} at {place}"))
        steps, aim = smap.integrator.steps_per_period, smap.integrator.map_error
        missed = f"; more than the {aim:.0e} that a map aims at" if smap.error > aim else ""
        lines.append(
            ("error", f"{smap.error:.1e} in |µ|, from a sample of cells; {steps} steps a period{missed}")
        )
        if smap.unconfirmed:
            lines.append(("not confirmed", unconfirmed_words(smap)))
    if smap.probability_stable is not None:
        lines.append(("chances", chance_words(smap)))
        lines.append(("their errors", "; ".join(filter(None, (whose, _error_words(smap))))))
    if folds is not None:
        lines.append(("folds", _fold_curve_words(folds, unit)))
    elif several.any():
        lines.append(("folds", "not followed; --folds draws their curve and finds its cusps"))
    lines.append(("not found", _missing(smap, count, coexisting)))
    if smap.other_rests.size:
        lines.append(("not sought", elsewhere_words(smap)))
    for name, (compiling, running) in (seconds or {}).items():
        words = f"{compiling + running:.1f} s: {compiling:.1f} s compiling, {running:.1f} s running"
        lines.append((f"time, {name}", words))
    width = max(len(name) for name, _ in lines)
    return "\n".join(f"{name:<{width}}  {words}" for name, words in lines)


def _error_words(smap: StabilityMap) -> str:
    """Say how large the standard errors of response and largest multiplier are, given a fit."""
    errors = smap.standard_errors or {}
    sizes = {
        "response": (100.0 * np.asarray(errors["response"]) / np.asarray(smap.response), " %"),
        "|µ|": (np.asarray(errors["spectral_radius"]), ""),
    }
    known = {name: (size[np.isfinite(size)], unit) for name, (size, unit) in sizes.items()}
    return ", ".join(
        f"{name} ± {np.median(size):.2g}{unit} in the median cell, {size.max():.2g}{unit} at most"
        for name, (size, unit) in known.items()
        if size.size
    )


def _span(axis: np.ndarray, unit: str) -> str:
    return f"{axis[0]:.4g} to {quantity(axis[-1], unit)}" if axis.size > 1 else quantity(axis[0], unit)


def _cells_holding(mask: np.ndarray) -> str:
    total = int(mask.sum())
    return f"{total} cell{'' if total == 1 else 's'} hold{'s' if total == 1 else ''}"


def _where(smap: StabilityMap, mask: np.ndarray) -> str:
    if not mask.any():
        return ""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    unit = drive_unit(smap.model.excitation)
    spans = (
        _span(np.asarray(axis)[[places[0], places[-1]]], own)
        for axis, places, own in ((smap.amplitudes, rows, unit), (smap.frequencies, columns, "Hz"))
    )
    return f" ({', '.join(spans)})"


def _coexisting_words(smap: StabilityMap, several: np.ndarray, sought: bool) -> str:
    if not sought:
        return "not sought; only the orbit of smallest motion in each cell. --coexisting seeks all"
    if not several.any():
        return "nowhere; each cell holds at most one orbit"
    most = int(np.max(np.asarray(smap.count)))
    return f"{_cells_holding(several)} several orbits, up to {most}{_where(smap, several)}"


def _scope(smap: StabilityMap) -> str:
    return "symmetric orbits only, by the half-period map" if smap.symmetric else "orbits of one drive period"


def _fold_curve_words(folds: FoldCurve, unit: str) -> str:
    ends = [
        f"{quantity(float(c.amplitude), unit)}, {quantity(float(c.frequency), 'Hz')}" for c in folds.cusps
    ]
    kind = "closed curve" if bool(folds.closed) else "open curve"
    return kind + (f", cusps at {' and '.join(ends)}" if ends else ", no cusp met")


def _missing(smap: StabilityMap, count: np.ndarray, coexisting: bool) -> str:
    codes = result_codes(smap)
    first = codes[0] if coexisting else codes
    empty = count == 0
    parts = [
        f"{np.sum(empty & (first == code))} {words}"
        for code, words in _REASONS.items()
        if np.any(empty & (first == code))
    ]
    words = f"{empty.sum()} cells" + (f" ({', '.join(parts)})" if parts else "")
    return words + (f"; {incomplete_words(smap)}" if smap.incomplete.any() else "")
