"""Linear regression of the force balance: the coefficients with which force and motion agree."""

import dataclasses
from collections.abc import Callable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy.optimize import lsq_linear

from ..._parameters import own_parameters
from ...elements import AbstractElement
from ...models import Instant, Isolator
from ._motion import Motion

BalanceProjection = Callable[[Float[np.ndarray, " time"]], Float[np.ndarray, " row"]]
"""Turns a force over time into the numbers that must balance, such as harmonics; must be linear."""

_UNDRIVEN = 0.01
"""A measured force below this share of the inertia is taken for noise, and the motion for a free decay."""


@dataclasses.dataclass(frozen=True)
class BalanceFit:
    """Coefficients from one regression of the force balance.

    Attributes:
        model: the model with the estimated coefficients; elements outside the regression stay as they were.
        unexplained: rms of the unbalanced force, as a share of the rms of the measured force (inertia where
            there is no drive) [1].
        fitted: catalogue names of the elements that took part.
    """

    model: Isolator
    unexplained: float
    fitted: tuple[str, ...]


def with_strength(element: AbstractElement, strength: float) -> AbstractElement:
    """Give an element with another strength.

    Args:
        element: the element.
        strength: new value of the field that `element.strength` names [its SI unit].

    Returns:
        The element; nothing else changes.
    """
    return eqx.tree_at(lambda e: getattr(e, e.strength), element, jnp.asarray(strength, dtype=float))


def _unbalanced_force(model: Isolator, motion: Motion) -> Float[np.ndarray, " time"]:
    """Give inertia plus restoring force minus drive [N]; zero where the model is right."""
    x, v = jnp.asarray(motion.displacement), jnp.asarray(motion.velocity)
    state = (x, v, *(jnp.zeros_like(x),) * model.internal_states)
    drive, _ = model.drive(Instant(jnp.asarray(motion.drive)))
    inertia = sum((element.inertia() for element in model.elements), start=model.mass)
    total = inertia * jnp.asarray(motion.acceleration) + model.restoring_force(state)
    total = total + inertia * drive if model.excitation == "base_acceleration" else total - drive
    return np.asarray(total)


def _force_of(model: Isolator, element: AbstractElement, motion: Motion) -> Float[np.ndarray, " time"]:
    """Give the contribution of an element to the balance [N], never as a difference of large forces."""
    x, v = jnp.asarray(motion.displacement), jnp.asarray(motion.velocity)
    a, u = jnp.asarray(motion.acceleration), jnp.asarray(motion.drive)
    gained = element.drive(u, jnp.zeros_like(u))[0] - u
    on_base = model.excitation == "base_acceleration"
    inertia = element.inertia() * (a + u if on_base else a)
    return np.asarray(element.force(x, v, ()) + inertia + (model.mass * gained if on_base else -gained))


def _unit_force(
    model: Isolator, element: AbstractElement, motion: Motion
) -> Float[np.ndarray, " time"] | None:
    """Give the force of an element of strength one; None unless its force is proportional to its strength."""
    if element.internal_states:
        return None
    unit, twice = (_force_of(model, with_strength(element, strength), motion) for strength in (1.0, 2.0))
    size = np.max(np.abs(unit), initial=0.0)
    in_proportion = np.max(np.abs(twice - 2.0 * unit), initial=0.0) <= 1e-9 * size
    return unit if size > 0 and in_proportion and np.all(np.isfinite(unit)) else None


def _rows(
    forces: list[Float[np.ndarray, " _"]], projections: tuple[BalanceProjection, ...]
) -> Float[np.ndarray, " row"]:
    return np.concatenate([project(force) for project, force in zip(projections, forces, strict=True)])


def _regressors(
    base: Isolator,
    names: tuple[str, ...],
    motions: tuple[Motion, ...],
    projections: tuple[BalanceProjection, ...],
) -> dict[int, Float[np.ndarray, " row"]]:
    """Give the regressor of every named element that has one, by its place in the model."""
    regressors = {}
    for place, element in enumerate(base.elements):
        forces = [_unit_force(base, element, motion) for motion in motions] if element.name in names else []
        if any(force is not None for force in forces):
            pairs = zip(forces, motions, strict=True)
            filled = [np.zeros_like(motion.drive) if force is None else force for force, motion in pairs]
            regressors[place] = _rows(filled, projections)
    return regressors


def fit_balance(
    model: Isolator,
    names: tuple[str, ...],
    motions: tuple[Motion, ...],
    projections: tuple[BalanceProjection, ...],
    mass_free: bool = False,
) -> BalanceFit:
    """Fit the coefficients that enter the force balance linearly, by least squares within their bounds.

    `m x'' + sum coefficient_i phi_i(x, x') = F` is linear in every coefficient, in the mass, in a gain and in
    an offset.

    Args:
        model: the structure; its present strengths do not matter.
        names: catalogue names of the elements whose strength is fitted; the others are absent.
        motions: measured motion and drive, one a record (or dwell).
        projections: how the balance of each is summarised.
        mass_free: whether the mass is unknown too; without a measured force it stays as declared.

    Returns:
        The fitted model.

    Source: S. F. Masri and T. K. Caughey, A nonparametric identification technique for nonlinear dynamic
    problems, J. Appl. Mech. 46 (1979) 433.
    """
    elements = tuple(with_strength(element, 0.0) for element in model.elements)
    base = Isolator(model.mass, elements, model.excitation)
    heavier = Isolator(2.0 * model.mass, elements, model.excitation)
    absent = _rows([_unbalanced_force(base, motion) for motion in motions], projections)
    inertia = _rows([_unbalanced_force(heavier, motion) for motion in motions], projections) - absent
    driven = inertia - absent
    is_driven = bool(np.linalg.norm(driven) > _UNDRIVEN * np.linalg.norm(inertia))
    mass_free = mass_free and is_driven
    regressors = _regressors(base, names, motions, projections)
    if not regressors and not mass_free:
        return BalanceFit(base, 1.0, ())
    specs = [dict(own_parameters(elements[place]))[elements[place].strength] for place in regressors]
    lower = np.array([spec.lower for spec in specs] + [0.0] * mass_free)
    upper = np.array([spec.upper for spec in specs] + [np.inf] * mass_free)
    target = driven if mass_free else -absent
    matrix = np.stack([*regressors.values(), *([inertia / float(model.mass)] if mass_free else [])], axis=1)
    size = np.linalg.norm(matrix, axis=0)
    size[size == 0] = 1.0
    values = lsq_linear(matrix / size, target, (lower * size, upper * size), method="bvls").x / size
    mass = float(values[-1]) if mass_free and values[-1] > 0 else float(model.mass)
    found = list(elements)
    for place, value in zip(regressors, values, strict=False):
        found[place] = with_strength(elements[place], float(value))
    reference = driven if is_driven else inertia
    return BalanceFit(
        model=Isolator(mass, tuple(found), model.excitation),  # pyright: ignore[reportArgumentType]
        unexplained=float(np.linalg.norm(matrix @ values - target) / np.linalg.norm(reference)),
        fitted=tuple(elements[place].name for place in regressors),
    )
