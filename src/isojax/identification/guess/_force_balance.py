"""Linear regression of the force balance: the coefficients with which force and motion agree."""

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from scipy.optimize import lsq_linear

from ..._parameters import own_parameters
from ..._quick_jit import quick_jit
from ..._types import on_device
from ...elements import AbstractElement
from ...models import Instant, Isolator, State
from ._internal_path import internal_states_along
from ._motion import Motion

BalanceProjection = Callable[[Float[np.ndarray, " time"]], Float[np.ndarray, " row"]]
"""Turns a force over time into the numbers that must balance, such as harmonics; must be linear."""

_SIGNALS = ("displacement", "velocity", "acceleration", "drive")
"""What of a measured motion enters the balance."""

_LAPS = 3
"""Times that each dwell's cycle is gone through, by the last of which internal states have settled."""

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


@quick_jit
def _unbalanced_force(model: Isolator, signals: tuple[Array, ...]) -> Float[Array, " time"]:
    """Give inertia plus restoring force minus drive [N]; zero where the model is right."""
    x, v, a, u = signals
    state = (x, v, *(jnp.zeros_like(x),) * model.internal_states)
    drive, _ = model.drive(Instant(u))
    inertia = sum((element.inertia() for element in model.elements), start=model.mass)
    total = inertia * a + model.restoring_force(state)
    return total + inertia * drive if model.excitation == "base_acceleration" else total - drive


@quick_jit
def _force_of(
    base: Isolator, element: AbstractElement, signals: tuple[Array, ...], internal: State
) -> Float[Array, " time"]:
    """Give the contribution of an element to the balance [N], never as a difference of large forces.

    Of `base` the mass and what is driven count.
    """
    x, v, a, u = signals
    gained = element.drive(u, jnp.zeros_like(u))[0] - u
    on_base = base.excitation == "base_acceleration"
    inertia = element.inertia() * (a + u if on_base else a)
    return element.force(x, v, internal) + inertia + (base.mass * gained if on_base else -gained)


def _where_proportional(
    unit: Float[np.ndarray, " time"], twice: Float[np.ndarray, " time"]
) -> Float[np.ndarray, " time"] | None:
    """Give the force of a strength of one; None unless that of two is twice as large."""
    size = np.max(np.abs(unit), initial=0.0)
    in_proportion = np.max(np.abs(twice - 2.0 * unit), initial=0.0) <= 1e-9 * size
    return unit if size > 0 and in_proportion and np.all(np.isfinite(unit)) else None


class _Path(NamedTuple):
    """The way that internal states go along measured motions.

    Attributes:
        visited: the samples in turn; each cycle of a dwell several times, until its start is forgotten.
        seen: where on that way each sample is seen, at its last visit.
    """

    visited: Int[np.ndarray, " visit"]
    seen: Int[np.ndarray, " time"]


def _path(motions: tuple[Motion, ...]) -> _Path:
    visited, seen, first, before = [], [], 0, 0
    for motion in motions:
        size = motion.drive.size
        laps, cycle = (_LAPS, motion.cycle) if motion.cycle else (1, size)
        own = np.tile(first + np.arange(size).reshape(-1, 1, cycle), (1, laps, 1))
        visited.append(own.ravel())
        seen.append(before + np.arange(own.size).reshape(own.shape)[:, -1].ravel())
        first, before = first + size, before + own.size
    return _Path(np.concatenate(visited), np.concatenate(seen))


class ForceBalance:
    """The balance of measured forces for one structure; the force of each law is evaluated once.

    `m x'' + sum coefficient_i phi_i(x, x', s) = F` is linear in every coefficient, in the mass, in a gain and
    in an offset. Internal states `s` follow the measured motion.

    Source: S. F. Masri and T. K. Caughey, A nonparametric identification technique for nonlinear dynamic
    problems, J. Appl. Mech. 46 (1979) 433.
    """

    def __init__(
        self,
        model: Isolator,
        motions: tuple[Motion, ...],
        projections: tuple[BalanceProjection, ...],
        mass_free: bool = False,
    ):
        """Take the structure and what was measured.

        Args:
            model: the structure; its present strengths do not matter.
            motions: measured motion and drive, one a record (or dwell).
            projections: how the balance of each is summarised.
            mass_free: whether the mass is unknown too; without a measured force it stays as declared.
        """
        # End to end: compiled code is made for each length.
        rows = ([getattr(one, name) for one in motions] for name in (*_SIGNALS, "step"))
        *self._signals, self._step = (on_device(np.concatenate(row)) for row in rows)
        self._signals, self._path = tuple(self._signals), _path(motions)
        self._ends = np.cumsum([one.drive.size for one in motions])[:-1]
        self._projections = projections
        self._elements = tuple(with_strength(element, 0.0) for element in model.elements)
        self._base = Isolator(model.mass, self._elements, model.excitation)
        heavier = Isolator(2.0 * model.mass, self._elements, model.excitation)
        absent, twice = (
            self._rows(self._apart(_unbalanced_force(one, self._signals))) for one in (self._base, heavier)
        )
        self._absent, self._inertia = absent, twice - absent
        self._driven = self._inertia - absent
        self._is_driven = bool(np.linalg.norm(self._driven) > _UNDRIVEN * np.linalg.norm(self._inertia))
        self._mass_free = mass_free and self._is_driven
        self._regressors = [self._regressor(element) for element in self._elements]

    def fit(self, names: tuple[str, ...], further: AbstractElement | None = None) -> BalanceFit:
        """Fit the coefficients that enter the balance linearly, by least squares within their bounds.

        Args:
            names: catalogue names of the elements of the structure whose strength is fitted; the others are
                absent.
            further: an element that the structure lacks, fitted beside them.

        Returns:
            The fitted model.
        """
        elements, rows = list(self._elements), list(self._regressors)
        if further is not None:
            elements.append(with_strength(further, 0.0))
            rows.append(self._regressor(elements[-1]))
            names = (*names, further.name)
        regressors = {
            place: row
            for place, (element, row) in enumerate(zip(elements, rows, strict=True))
            if element.name in names and row is not None
        }
        base, mass_free = self._base, self._mass_free
        if not regressors and not mass_free:
            return BalanceFit(base, 1.0, ())
        specs = [dict(own_parameters(elements[place]))[elements[place].strength] for place in regressors]
        lower = np.array([spec.lower for spec in specs] + [0.0] * mass_free)
        upper = np.array([spec.upper for spec in specs] + [np.inf] * mass_free)
        target = self._driven if mass_free else -self._absent
        columns = [*regressors.values(), *([self._inertia / float(base.mass)] if mass_free else [])]
        matrix = np.stack(columns, axis=1)
        size = np.linalg.norm(matrix, axis=0)
        size[size == 0] = 1.0
        values = lsq_linear(matrix / size, target, (lower * size, upper * size), method="bvls").x / size
        mass = float(values[-1]) if mass_free and values[-1] > 0 else float(base.mass)
        for place, value in zip(regressors, values, strict=False):
            elements[place] = with_strength(elements[place], float(value))
        reference = self._driven if self._is_driven else self._inertia
        return BalanceFit(
            model=Isolator(mass, tuple(elements), base.excitation),  # pyright: ignore[reportArgumentType]
            unexplained=float(np.linalg.norm(matrix @ values - target) / np.linalg.norm(reference)),
            fitted=tuple(elements[place].name for place in regressors),
        )

    def _internal(self, element: AbstractElement) -> State:
        """Give the internal states of a law at each sample."""
        if not element.internal_states:
            return ()
        alone = Isolator(self._base.mass, (element,), self._base.excitation)
        x, v, _, u, step = (
            on_device(np.asarray(signal)[self._path.visited]) for signal in (*self._signals, self._step)
        )
        histories = internal_states_along(alone, x, v, x, u, step)
        return tuple(on_device(np.asarray(history)[self._path.seen]) for history in histories)

    def _apart(self, forces: Float[Array, " time"]) -> list[Float[np.ndarray, " _"]]:
        """Give forces motion by motion."""
        return np.split(np.asarray(forces), self._ends)

    def _rows(self, forces: list[Float[np.ndarray, " _"]]) -> Float[np.ndarray, " row"]:
        pairs = zip(self._projections, forces, strict=True)
        return np.concatenate([project(force) for project, force in pairs])

    def _regressor(self, element: AbstractElement) -> Float[np.ndarray, " row"] | None:
        """Give the balance of an element of strength one; None where it has no such force.

        Without a measured force nothing would balance as well as no mass and no springs.
        """
        if not self._is_driven and float(with_strength(element, 1.0).inertia()) != 0.0:
            return None
        bare = Isolator(self._base.mass, (), self._base.excitation)
        unit, twice = (
            self._apart(_force_of(bare, one, self._signals, self._internal(one)))
            for one in (with_strength(element, strength) for strength in (1.0, 2.0))
        )
        forces = [_where_proportional(*pair) for pair in zip(unit, twice, strict=True)]
        if all(force is None for force in forces):
            return None
        pairs = zip(forces, unit, strict=True)
        return self._rows([np.zeros_like(one) if force is None else force for force, one in pairs])
