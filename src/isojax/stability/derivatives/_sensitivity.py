"""How orbits, their multipliers and whatever follows from them move with each coefficient."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._parameters import find_name, full_names, list_parameters
from ..._quantities import DRIVE_UNITS, typeset_unit
from ..._show import Row, brief, shown
from ..._types import check_float64
from ...models import Isolator
from ..branch import CodimensionTwoPoint, SpecialPoint
from ..map import StabilityMap
from ..orbit import Orbit
from ..response import Resonance
from ._parameter_values import DRIVE
from ._subjects import Subject, as_subject

_ROUNDING_OF_COVARIANCE = 1e-8
"""Least eigenvalue of a covariance, over that of equal variances, down to which it is rounding."""


@shown
class Sensitivity(eqx.Module):
    """Derivatives of quantities by parameters, and what the parameters' error bars make of them.

    Attributes:
        parameters: names, such as `cubic_stiffness.coefficient`; `drive.amplitude` and `drive.frequency`.
        symbols: of the parameters; "" for the drive.
        units: of the parameters.
        at: their values; NaN for the drive of a map, which differs from cell to cell.
        values: the quantities, by name.
        derivatives: of each quantity, parameter first [unit of the quantity over unit of the parameter].
        standard_errors: of each quantity, from the covariance of the parameters; None without one.
        error: by which derivatives of a map that were read off tables differ at most from those found cell by
            cell with the same steps, from a sample: of the response and of sum and product of multipliers,
            each over its size, its median over the map, or a ten-thousandth of what a relative change of any
            parameter moves, whichever is largest. What the steps of the map leave is not in it, and a single
            multiplier has more where two nearly meet. None where all were found cell by cell.
    """

    parameters: tuple[str, ...] = eqx.field(static=True)
    symbols: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)
    at: Float[Array, " parameter"]
    values: Mapping[str, Array]
    derivatives: Mapping[str, Array]
    standard_errors: Mapping[str, Array] | None
    error: float | None

    def by(self, quantity: str, parameter: str) -> Array:
        """Give one derivative.

        Args:
            quantity: its name.
            parameter: its name, or its symbol.

        Returns:
            The derivative, in the shape of the quantity.

        Raises:
            ValueError: if either is not among those that were asked for.
        """
        what = find_name(dict.fromkeys(self.values, ""), quantity, "quantity")
        symbols = dict(zip(self.parameters, self.symbols, strict=True))
        return self.derivatives[what][self.parameters.index(find_name(symbols, parameter, "parameter"))]

    def relative(self, quantity: str) -> Array:
        """Give the relative change of a quantity for a relative change of each parameter.

        Args:
            quantity: its name.

        Returns:
            `(p / q) dq/dp`, parameter first.
        """
        slope = self.derivatives[quantity]
        return slope * self.at.reshape(-1, *(1,) * (slope.ndim - 1)) / self.values[quantity]

    def _headline(self) -> str:
        return f"of {', '.join(self.values)} by {len(self.parameters)} parameters"

    def _rows(self) -> list[Row]:
        errors = self.standard_errors or {}
        own = [
            Row(name, brief(value), f"± {brief(errors[name])}" if name in errors else "")
            for name, value in self.values.items()
        ]
        return [*own, *(self._slopes(name) for name in self.parameters)]

    def _shown(self) -> list[str]:
        """Name the quantities whose changes are shown: those of one number, else all real ones."""
        real = [name for name, slope in self.derivatives.items() if not np.iscomplexobj(slope)]
        return [name for name in real if np.ndim(self.values[name]) == 0] or real

    def _slopes(self, parameter: str) -> Row:
        """Show by how much each quantity moves with a parameter that grows by one percent."""
        place = self.parameters.index(parameter)
        at, unit = float(np.asarray(self.at)[place]), self.units[place]
        # The drive of a map differs from cell to cell, and of zero there are no percent.
        step, words = (0.01 * at, "1 %") if np.isfinite(at) and at else (1.0, f"1 {typeset_unit(unit)}")
        moved = [self._moved(name, place, step) for name in self._shown()]
        return Row(f"{parameter} +{words}", ", ".join(moved) or brief(self.derivatives), unit)

    def _moved(self, name: str, place: int, step: float) -> str:
        """Say how a quantity moves with a step of a parameter: in percent, unless a number of it is zero."""
        value = np.asarray(self.values[name])
        change = step * np.asarray(self.derivatives[name])[place]
        sign = "" if np.any(value == 0.0) else " %"
        change = 100.0 * change / value if sign else change
        if change.ndim == 0:
            return f"{name} {float(change) + 0.0:+.3g}{sign}"
        known = change[np.isfinite(change)]
        if not known.size:
            return f"{name} unknown"
        largest = known[np.argmax(np.abs(known))] + 0.0  # no -0
        return f"{name} {np.median(np.abs(known)):.2g} ({largest:+.2g}){sign}"

    def _lines(self) -> list[str]:
        several = any(np.ndim(self.values[name]) for name in self._shown())
        lines = (
            ["  changes of several numbers: the median size, and the largest in brackets"] if several else []
        )
        if self.error is not None:
            lines.append(
                f"  derivatives read off tables: relative error at most {self.error:.2g}, by a sample"
            )
        return lines


def sensitivity(
    subject: Orbit
    | StabilityMap
    | SpecialPoint
    | CodimensionTwoPoint
    | Resonance
    | Callable[[Isolator], Mapping[str, Array] | Array],
    model: Isolator | None = None,
    *,
    parameters: Sequence[str] | None = None,
    covariance: Float[np.ndarray, "parameter parameter"] | None = None,
    covariance_of: Sequence[str] | None = None,
) -> Sensitivity:
    """Give derivatives by the coefficients, the mass and the drive.

    By the implicit function theorem at the orbit, not through the iterations that found it, nor by
    differences. Those of a large map are read off tables of such derivatives, within the `error` that a
    sample of cells shows.

    Args:
        subject: an orbit (`y0`, `amplitude`, and `multipliers` and `spectral_radius` of its `floquet`); a map
            (`response`, `multipliers`, `spectral_radius` in every cell); a special point of a branch, such as
            a fold (`value` of the branch's parameter, `y0`), or of a curve of bifurcations, such as a cusp
            (`amplitude`, `frequency`); a resonance (`amplitude`, `frequency`, and `spectral_radius` of its
            orbit); or a function of a model that gives one array or several by name, such as
            `lambda m: ij.transmissibility(m, ...).force`.
        model: the isolator, where `subject` is a function.
        parameters: names or symbols of the parameters to differentiate by; all of the model and, but for a
            function, the drive, if omitted; at a special point without the branch's own parameter.
        covariance: of parameters, such as a fit's.
        covariance_of: their names or symbols, in its order, such as a fit's `free`.

    Returns:
        Values, derivatives and, with a covariance, standard errors.

    Raises:
        ValueError: if a parameter is unknown or named twice, the covariance and its names do not belong
            together, or `model` is missing or superfluous.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: implicit function theorem; first-order propagation of errors.

    Example:
        >>> drive = ij.Harmonic(amplitude=150.0, frequency=4.3)
        >>> orbit = ij.find_periodic_orbit(ij.paper.y_direction(), drive)
        >>> sens = ij.sensitivity(orbit)
        >>> place = sens.parameters.index("linear_damping.coefficient")
        >>> bool(sens.derivatives["spectral_radius"][place] < 0.0)
        True
    """
    check_float64()
    of = as_subject(subject, model)
    entries = _entries_of(of)
    names = tuple(entries) if parameters is None else _named(of, entries, "parameters", parameters)
    if covariance_of is not None:
        covariance_of = _named(of, entries, "covariance_of", covariance_of)
    matrix = _covariance(names, covariance, covariance_of)
    at = jnp.stack([jnp.asarray(entries[name].value, dtype=float) for name in names])
    values, slopes, error = of.slopes(names, at)
    errors = None
    if matrix is not None:
        errors = {name: _standard_error(slope, jnp.asarray(matrix)) for name, slope in slopes.items()}
    symbols, units = (tuple(getattr(entries[name], what) for name in names) for what in ("symbol", "unit"))
    return Sensitivity(names, symbols, units, at, values, slopes, errors, error)


class _Entry(NamedTuple):
    """What a quantity can be differentiated by."""

    symbol: str
    unit: str
    value: Any


def _entries_of(of: Subject) -> dict[str, _Entry]:
    """Give all by which a subject can be differentiated, by name."""
    entries = {
        entry.name: _Entry(entry.spec.symbol, entry.spec.unit, entry.value)
        for entry in list_parameters(of.model)
    }
    if of.drive is not None:
        units = DRIVE_UNITS[of.model.excitation], "Hz"
        entries |= {
            name: _Entry("", unit, value) for name, unit, value in zip(DRIVE, units, of.drive, strict=True)
        }
    return {name: entry for name, entry in entries.items() if name not in of.solved}


def _named(
    of: Subject, entries: Mapping[str, _Entry], argument: str, given: Sequence[str]
) -> tuple[str, ...]:
    """Give the full names of parameters that a caller named."""
    names = full_names(of.model, given, argument, *(name for name in DRIVE if name in entries))
    lost = [name for name in names if name not in entries]
    if lost or not names:
        found = f"names {lost[0]!r}" if lost else "is empty"
        raise ValueError(f"Argument `{argument}` must name some of {', '.join(entries)}, but {found}.")
    return names


def _covariance(
    names: tuple[str, ...],
    covariance: Float[np.ndarray, "parameter parameter"] | None,
    covariance_of: Sequence[str] | None,
) -> np.ndarray | None:
    """Give the covariance in the order of the parameters; zero for those that it says nothing of."""
    if (covariance is None) != (covariance_of is None):
        raise ValueError(
            "Arguments `covariance` and `covariance_of` must be given together, but one is missing."
        )
    if covariance is None or covariance_of is None:
        return None
    given = np.asarray(covariance, dtype=float)
    if given.shape != (len(covariance_of),) * 2:
        raise ValueError(
            f"Argument `covariance` must have a row and a column for each of {len(covariance_of)} names, but "
            f"has shape {given.shape}."
        )
    size = np.sqrt(np.abs(np.diag(given)))
    scaled = given / np.outer(np.where(size > 0.0, size, 1.0), np.where(size > 0.0, size, 1.0))
    if np.all(np.isfinite(given)):  # what the records do not determine may be NaN, and makes the error NaN
        least = float(np.linalg.eigvalsh(scaled).min())
        if np.any(np.abs(scaled - scaled.T) > _ROUNDING_OF_COVARIANCE) or least < -_ROUNDING_OF_COVARIANCE:
            raise ValueError(
                "Argument `covariance` must be symmetric, with no negative variance in any direction, but "
                f"its least eigenvalue, over that of equal variances, is {least:.2g}."
            )
    missing = [name for name in covariance_of if name not in names]
    if missing:
        raise ValueError(f"Argument `parameters` must hold all of `covariance_of`, but lacks {missing[0]!r}.")
    full = np.zeros((len(names),) * 2)
    places = [names.index(name) for name in covariance_of]
    full[np.ix_(places, places)] = given
    return full


def _standard_error(slope: Array, covariance: Array) -> Array:
    """Propagate a covariance to first order; of a complex quantity, its real and imaginary part together."""
    real = jnp.einsum("i...,ij,j...->...", jnp.real(slope), covariance, jnp.real(slope))
    if not jnp.iscomplexobj(slope):
        return jnp.sqrt(real)
    imaginary = jnp.einsum("i...,ij,j...->...", jnp.imag(slope), covariance, jnp.imag(slope))
    return jnp.sqrt(real + imaginary)
