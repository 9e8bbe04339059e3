"""How orbits, their multipliers and whatever follows from them move with each coefficient."""

from collections.abc import Callable, Mapping, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._parameters import list_parameters
from ..._types import check_float64
from ...excitations import Harmonic
from ...models import Isolator
from ..branch import Family, SpecialPoint, special_point
from ..map import StabilityMap
from ..orbit import Orbit, find_periodic_orbit
from ._map_derivatives import map_slopes
from ._parameter_values import DRIVE, with_values


class Sensitivity(eqx.Module):
    """Exact derivatives of quantities by parameters, and what the parameters' error bars make of them.

    Attributes:
        parameters: names, such as `cubic_stiffness.coefficient`; `drive.amplitude` and `drive.frequency`.
        units: of the parameters.
        at: their values; NaN for the drive of a map, which differs from cell to cell.
        values: the quantities, by name.
        derivatives: of each quantity, parameter first [unit of the quantity over unit of the parameter].
        standard_errors: of each quantity, from the covariance of the parameters; None without one.
    """

    parameters: tuple[str, ...] = eqx.field(static=True)
    units: tuple[str, ...] = eqx.field(static=True)
    at: Float[Array, " parameter"]
    values: Mapping[str, Array]
    derivatives: Mapping[str, Array]
    standard_errors: Mapping[str, Array] | None

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


def sensitivity(
    subject: Orbit | StabilityMap | SpecialPoint | Callable[[Isolator], Mapping[str, Array] | Array],
    model: Isolator | None = None,
    *,
    parameters: Sequence[str] | None = None,
    covariance: Float[np.ndarray, "parameter parameter"] | None = None,
    covariance_of: Sequence[str] | None = None,
) -> Sensitivity:
    """Give exact derivatives by the coefficients, the mass and the drive.

    By the implicit function theorem at the orbit, not through the iterations that found it.

    Args:
        subject: an orbit (`y0`, `amplitude`, `multipliers`, `spectral_radius`); a map (`response`,
            `multipliers`, `spectral_radius` in every cell); a special point of a branch, such as a fold
            (`value` of the branch's parameter, `y0`); or a function of a model that gives one array or
            several by name, such as `lambda m: ij.transmissibility(m, ...).force`.
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
    function = not isinstance(subject, Orbit | StabilityMap | SpecialPoint)
    if function == (model is None):
        raise ValueError(
            "Argument `model` must be given where `subject` is a function, and only there, but is "
            f"{'missing' if model is None else 'given'}."
        )
    of = model if isinstance(model, Isolator) else _model_of(subject)
    entries = {entry.name: (entry.spec.unit, entry.value) for entry in list_parameters(of)}
    if isinstance(subject, Orbit):
        entries[DRIVE[0]] = ("N", jnp.asarray(subject.excitation.amplitude))
        entries[DRIVE[1]] = ("Hz", jnp.asarray(subject.excitation.frequency))
    elif isinstance(subject, SpecialPoint):
        entries[DRIVE[0]], entries[DRIVE[1]] = ("N", subject.amplitude), ("Hz", subject.frequency)
        for own in subject.family.names:
            entries.pop(f"drive.{own}" if own in ("amplitude", "frequency") else own)
    elif isinstance(subject, StabilityMap):
        # Differentiated cell by cell, at each cell's own drive.
        nothing = jnp.asarray(jnp.nan)
        entries |= {DRIVE[0]: ("N", nothing), DRIVE[1]: ("Hz", nothing)}
    names = tuple(entries) if parameters is None else tuple(parameters)
    for name in (*names, *(covariance_of or ())):
        if name not in entries:
            raise ValueError(
                f"Argument `parameters` must name some of {', '.join(entries)}, but names {name!r}."
            )
    matrix = _covariance(names, covariance, covariance_of)
    at = jnp.stack([jnp.asarray(entries[name][1], dtype=float) for name in names])
    if isinstance(subject, StabilityMap):
        values, slopes = map_slopes(subject, names)
    elif isinstance(subject, Orbit):
        values, slopes = _orbit_slopes(subject, names, at)
    elif isinstance(subject, SpecialPoint):
        values, slopes = _point_slopes(subject, names, at)
    else:
        values, slopes = _slopes(_by_name(subject), of, names, at)
    errors = None
    if matrix is not None:
        errors = {name: _standard_error(slope, jnp.asarray(matrix)) for name, slope in slopes.items()}
    return Sensitivity(names, tuple(entries[name][0] for name in names), at, values, slopes, errors)


def _model_of(subject: object) -> Isolator:
    return subject.family.model if isinstance(subject, SpecialPoint) else subject.model  # type: ignore[attr-defined]


def _by_name(
    function: Callable[[Isolator], Mapping[str, Array] | Array],
) -> Callable[[Isolator], dict[str, Array]]:
    def named(model: Isolator) -> dict[str, Array]:
        given = function(model)
        return dict(given) if isinstance(given, Mapping) else {"value": jnp.asarray(given)}

    return named


def _slopes(
    function: Callable[[Isolator], dict[str, Array]], model: Isolator, names: tuple[str, ...], at: Array
) -> tuple[dict[str, Array], dict[str, Array]]:
    def of(numbers: Array) -> tuple[dict[str, Array], dict[str, Array]]:
        given = function(with_values(model, names, numbers))
        return given, given

    slopes, values = jax.jacfwd(of, has_aux=True)(at)
    return values, {name: jnp.moveaxis(slope, -1, 0) for name, slope in slopes.items()}


def _point_slopes(
    point: SpecialPoint, names: tuple[str, ...], at: Array
) -> tuple[dict[str, Array], dict[str, Array]]:
    family = point.family
    shares = (point.value[None] - family.start) / (family.stop - family.start)
    fixed = (jnp.asarray(family.amplitude), jnp.asarray(family.frequency))

    def of(numbers: Array) -> tuple[dict[str, Array], dict[str, Array]]:
        drive = [numbers[names.index(n)] if n in names else v for n, v in zip(DRIVE, fixed, strict=True)]
        model = with_values(family.model, names, numbers)
        there = Family(model, drive[0], drive[1], family.start, family.stop, family.names)
        found = special_point(
            there,
            point.integrator,
            point.kind,
            point.periods,
            point.symmetric,
            point.branch,
            jax.lax.stop_gradient(point.y0),
            shares,
        )
        given = {"value": found.value, "y0": found.y0}
        return given, given

    slopes, values = jax.jacfwd(of, has_aux=True)(at)
    return values, {name: jnp.moveaxis(slope, -1, 0) for name, slope in slopes.items()}


def _orbit_slopes(
    orbit: Orbit, names: tuple[str, ...], at: Array
) -> tuple[dict[str, Array], dict[str, Array]]:
    symmetric = bool(jnp.all(jnp.isfinite(orbit.floquet.half_period_multipliers)))
    drive = (jnp.asarray(orbit.excitation.amplitude), jnp.asarray(orbit.excitation.frequency))
    return _differentiated(orbit.model, drive, orbit.y0, orbit.periods, symmetric, names, at)


@eqx.filter_jit
def _differentiated(
    model: Isolator,
    drive: tuple[Array, Array],
    start: Array,
    periods: int,
    symmetric: bool,
    names: tuple[str, ...],
    at: Array,
) -> tuple[dict[str, Array], dict[str, Array]]:
    def of(numbers: Array) -> tuple[dict[str, Array], dict[str, Array]]:
        pushed = [numbers[names.index(n)] if n in names else v for n, v in zip(DRIVE, drive, strict=True)]
        there = with_values(model, names, numbers)
        found = find_periodic_orbit(
            there, Harmonic(*pushed), start=start, periods=periods, symmetric=symmetric
        )
        given = {
            "y0": found.y0,
            "amplitude": found.amplitude,
            "multipliers": found.floquet.multipliers,
            "spectral_radius": found.floquet.spectral_radius,
        }
        return given, given

    slopes, values = jax.jacfwd(of, has_aux=True)(at)
    return values, {name: jnp.moveaxis(slope, -1, 0) for name, slope in slopes.items()}


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
