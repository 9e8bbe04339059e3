"""How orbits, their multipliers and whatever follows from them move with each coefficient."""

from collections.abc import Callable, Mapping, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._parameters import list_parameters
from ..._quantities import DRIVE_UNITS
from ..._show import Row, brief, shown
from ..._types import check_float64
from ...models import Isolator
from ..branch import CodimensionTwoPoint, SpecialPoint
from ..map import StabilityMap
from ..orbit import Orbit
from ..response import Resonance
from ._parameter_values import DRIVE
from ._subjects import as_subject


@shown
class Sensitivity(eqx.Module):
    """Derivatives of quantities by parameters, and what the parameters' error bars make of them.

    Attributes:
        parameters: names, such as `cubic_stiffness.coefficient`; `drive.amplitude` and `drive.frequency`.
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
            parameter: its name.

        Returns:
            The derivative, in the shape of the quantity.

        Raises:
            ValueError: if either is not among those that were asked for.
        """
        for name, known, word in (
            (quantity, tuple(self.values), "quantity"),
            (parameter, self.parameters, "parameter"),
        ):
            if name not in known:
                raise ValueError(f"Argument `{word}` must be one of {', '.join(known)}, but is {name!r}.")
        return self.derivatives[quantity][self.parameters.index(parameter)]

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
        off = self.error
        error = (
            [] if off is None else [Row("error", f"{off:.1e}", "of derivatives, by reading them off tables")]
        )
        return [*own, *error, *(self._slopes(name) for name in self.parameters)]

    @property
    def _of_cells(self) -> bool:
        return any(np.ndim(value) > 1 and not np.iscomplexobj(value) for value in self.values.values())

    def _range(self, name: str, place: int, at: float) -> str:
        """Give least and largest percentage over the cells of a map; "" where there is none."""
        slope, value = np.asarray(self.derivatives[name])[place], np.asarray(self.values[name])
        if np.iscomplexobj(slope) or not np.isfinite(at):
            return ""
        with np.errstate(divide="ignore", invalid="ignore"):
            moved = at * slope / value
        moved = moved[np.isfinite(moved)]
        return f"{moved.min():+.3g} to {moved.max():+.3g} %" if moved.size else ""

    def _slopes(self, parameter: str) -> Row:
        """Show by how many percent each scalar moves with a parameter that grows by one percent.

        In a map, the least and the most over its cells; by a drive of its own in each cell, nothing.
        """
        place = self.parameters.index(parameter)
        at = float(np.asarray(self.at)[place])
        over = {name: self._range(name, place, at) for name in self.derivatives} if self._of_cells else {}
        if over:
            words = ", ".join(f"{name} {span}" for name, span in over.items() if span)
            return Row(f"{parameter} +1 %", words or "from cell to cell", self.units[place])
        moved = [
            f"{name} {at * float(np.asarray(slope)[place]) / float(np.asarray(self.values[name])):+.3g} %"
            for name, slope in self.derivatives.items()
            if np.ndim(slope) == 1 and not np.iscomplexobj(slope)
        ]
        return Row(f"{parameter} +1 %", ", ".join(moved) or brief(self.derivatives), self.units[place])


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
        parameters: names of the parameters to differentiate by; all of the model and, but for a
            function, the drive, if omitted; at a special point without the branch's own parameter.
        covariance: of parameters, such as a fit's.
        covariance_of: their names, in its order, such as a fit's `free`.

    Returns:
        Values, derivatives and, with a covariance, standard errors.

    Raises:
        ValueError: if a parameter is unknown, the covariance and its names do not belong together, or `model`
            is missing or superfluous.
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
    entries = {entry.name: (entry.spec.unit, entry.value) for entry in list_parameters(of.model)}
    if of.drive is not None:
        entries |= zip(
            DRIVE, zip((DRIVE_UNITS[of.model.excitation], "Hz"), of.drive, strict=True), strict=True
        )
    entries = {name: entry for name, entry in entries.items() if name not in of.solved}
    names = tuple(entries) if parameters is None else tuple(parameters)
    for name in (*names, *(covariance_of or ())):
        if name not in entries:
            raise ValueError(
                f"Argument `parameters` must name some of {', '.join(entries)}, but names {name!r}."
            )
    matrix = _covariance(names, covariance, covariance_of)
    at = jnp.stack([jnp.asarray(entries[name][1], dtype=float) for name in names])
    values, slopes, error = of.slopes(names, at)
    errors = None
    if matrix is not None:
        errors = {name: _standard_error(slope, jnp.asarray(matrix)) for name, slope in slopes.items()}
    return Sensitivity(names, tuple(entries[name][0] for name in names), at, values, slopes, errors, error)


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
