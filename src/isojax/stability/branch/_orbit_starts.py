"""States from which orbits beside a branch are sought, over the parameter and the size of the motion."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._quick_jit import quick_jit
from ..orbit import answer_scale, balanced_motion, imposed_balance, rest_displacement
from ._parameter_family import ParameterFamily

PLACES = 12
"""Values of the parameter at which states are spread around the branch."""

_SHARE_COUNT, _SIZE_COUNT = 48, 160
"""Values of the parameter and displacement amplitudes of the tables of the one-harmonic balance."""

_DECADES = (-6.0, 4.0)
"""Powers of ten of these amplitudes, over the largest `answer_scale`."""

_RADII, _DIRECTIONS = 8, 6
"""Distances from the branch's own motion, and directions, of the states spread at one value."""

_NEAREST, _FARTHEST = 0.3, 1.5
"""Least and largest of these distances, over the least and largest displacement of the balance."""

_ALONG_RESONANCE = 16
"""Points along the resonance of n drive periods around which states are spread."""

_NEARBY = 0.02
"""Distance of a parameter, over its range, up to which points of the branch count as being there."""

_LARGEST_FREE = 30.0
"""Largest displacement along it, over the largest forced one: of a linear isolator it has no end."""


class OrbitStarts(NamedTuple):
    """States from which orbits of some drive periods are sought; start first.

    Attributes:
        shares: of the parameter's range.
        states: at t = 0, SI units.
        sizes: displacement amplitude of the motion that is sought [m].
    """

    shares: Float[np.ndarray, " start"]
    states: Float[np.ndarray, "start state"]
    sizes: Float[np.ndarray, " start"]

    def where(self, which: np.ndarray) -> "OrbitStarts":
        """Give some of the starts."""
        return OrbitStarts(*(values[which] for values in self))


class OneHarmonic(NamedTuple):
    """The balance of one harmonic over displacement amplitude and parameter.

    Attributes:
        sizes: displacement amplitudes [m].
        shares: of the parameter's range.
        force: drive amplitude that holds each motion.
        in_phase: part of it in phase with the displacement: it changes sign at resonance.
        drive: drive amplitude that acts at each value of the parameter.
        frequency: drive frequency there [Hz].
    """

    sizes: Float[np.ndarray, " size"]
    shares: Float[np.ndarray, " share"]
    force: Float[np.ndarray, "share size"]
    in_phase: Float[np.ndarray, "share size"]
    drive: Float[np.ndarray, " share"]
    frequency: Float[np.ndarray, " share"]


@quick_jit
def _answer_scales(family: ParameterFamily, shares: Float[Array, " share"]) -> Float[Array, " share"]:
    """Give about how large the answers to the drive are."""

    def one(share: Array) -> Array:
        setting = family.at(share[None])
        rest = rest_displacement(setting.model)
        return answer_scale(setting.model, jnp.abs(setting.amplitude), jnp.asarray(setting.frequency), rest)

    return jax.vmap(one)(shares)


@quick_jit
def _tables(
    family: ParameterFamily, shares: Float[Array, " share"], sizes: Float[Array, " size"], periods: Array
) -> tuple[Array, Array, Array, Array]:
    """Give force, its part in phase, and the drive that acts: amplitude and frequency."""

    def row(share: Array) -> tuple[Array, Array, Array, Array]:
        setting = family.at(share[None])
        rest = rest_displacement(setting.model)
        # Of the motion of n drive periods the free part has the n-th of the frequency.
        needed, _ = imposed_balance(setting.model, sizes, setting.frequency / periods + 0.0 * sizes, rest)
        cosine = jnp.broadcast_to(jnp.asarray(needed.cosine), sizes.shape)
        drive = jnp.asarray(setting.amplitude), jnp.asarray(setting.frequency)
        force = jnp.hypot(needed.sine, cosine)
        if setting.model.harmonics:
            # They take part in the motion of one period; a free part of several has none of them.
            whole = balanced_motion(setting.model, sizes, setting.frequency + 0.0 * sizes, rest).drive
            share = jnp.where(periods == 1.0, jnp.hypot(whole.sine, jnp.asarray(whole.cosine)) / force, 1.0)
            force, cosine = share * force, share * cosine
        return force, cosine, *drive

    return jax.vmap(row)(shares)


@quick_jit
def _balanced_states(
    family: ParameterFamily, shares: Float[Array, " start"], sizes: Float[Array, " start"]
) -> Float[Array, "start state"]:
    """Give the state at phase zero of the recorded drive of motions in the balance of one harmonic."""

    def one(share: Array, size: Array) -> Array:
        setting = family.at(share[None])
        model, frequency = setting.model, jnp.asarray(setting.frequency)
        rest = rest_displacement(model)
        balanced = balanced_motion(model, size, frequency, rest)
        drive, internal, _ = balanced
        phase = -jnp.arctan2(drive.cosine, drive.sine) - 2.0 * math.pi * frequency * model.shift()
        x, v = balanced.at(size, phase)
        samples = internal[0].shape[0] if internal else 1
        place = jnp.round(phase / (2.0 * math.pi) * samples).astype(int) % samples
        return jnp.stack([rest + x, v, *(values[place] for values in internal)])

    return jax.vmap(one)(shares, sizes)


def one_harmonic(family: ParameterFamily, periods: int = 1) -> OneHarmonic:
    """Give the balance of one harmonic, of the frequency of the drive or its n-th.

    Args:
        family: isolators and drives along one parameter.
        periods: n.

    Returns:
        The tables.
    """
    shares = (np.arange(_SHARE_COUNT) + 0.5) / _SHARE_COUNT
    largest = float(np.nanmax(np.asarray(_answer_scales(family, jnp.asarray(shares)))))
    sizes = largest * np.logspace(*_DECADES, _SIZE_COUNT)
    tables = _tables(family, jnp.asarray(shares), jnp.asarray(sizes), jnp.asarray(float(periods)))
    return OneHarmonic(sizes, shares, *(np.asarray(table) for table in tables))


def _crossings(values: Float[np.ndarray, "share size"], balance: OneHarmonic) -> Float[np.ndarray, "place 2"]:
    """Give shares and sizes at which a table changes sign, along either."""
    found = []
    logarithms = np.log(balance.sizes)
    for axis, places in ((0, balance.shares), (1, logarithms)):
        table = np.moveaxis(values, axis, 0)
        row, column = np.nonzero((table[:-1] * table[1:] < 0.0) & np.isfinite(table[:-1] * table[1:]))
        first, second = table[row, column], table[row + 1, column]
        at = places[row] + first / (first - second) * (places[row + 1] - places[row])
        found.append((at, logarithms[column]) if axis == 0 else (balance.shares[column], at))
    shares, sizes = (np.concatenate(own) for own in zip(*found, strict=True))
    return np.stack([shares, np.exp(sizes)], axis=1)


def _resonance_peaks(balance: OneHarmonic) -> Float[np.ndarray, "place 2"]:
    """Give shares and sizes at which the force just holds a motion at resonance: ends of narrow curves."""
    change = balance.in_phase[:-1] * balance.in_phase[1:] < 0.0
    first, second = balance.in_phase[:-1], balance.in_phase[1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        part = np.where(change, first / (first - second), np.nan)
        # What is not in phase is the force at resonance.
        across = np.sqrt(np.maximum(balance.force**2 - balance.in_phase**2, 0.0))
        over = across[:-1] + part * np.diff(across, axis=0)
        over -= balance.drive[:-1, None] + part * np.diff(balance.drive)[:, None]
        share = balance.shares[:-1, None] + part * np.diff(balance.shares)[:, None]
    # One resonance a size: of several the first.
    row = np.argmax(change, axis=0)
    column = np.arange(balance.sizes.size)
    over, share = over[row, column], share[row, column]
    place = np.flatnonzero(over[:-1] * over[1:] < 0.0)
    at = over[place] / (over[place] - over[place + 1])
    sizes = np.exp(np.log(balance.sizes[place]) + at * np.diff(np.log(balance.sizes))[place])
    return np.stack([share[place] + at * np.diff(share)[place], sizes], axis=1)


def orbit_starts(
    family: ParameterFamily,
    forced: OneHarmonic,
    periods: int,
    unknowns: Float[np.ndarray, "point unknown"],
    scale: Float[np.ndarray, " state"],
) -> OrbitStarts:
    """Give states from which orbits of some drive periods are sought.

    Around the branch, in all directions, up to the displacements that the balance of one harmonic allows;
    along the resonance of n periods, where a subharmonic of order 1/n lies; and, of one period, every motion
    of the balance itself.

    Args:
        family: isolators and drives along one parameter.
        forced: its balance of one harmonic.
        periods: drive periods of the orbits.
        unknowns: scaled states and shares of the branch.
        scale: size of each state.

    Returns:
        The states.
    """
    held = _crossings(forced.force - forced.drive[:, None], forced)
    own = forced if periods == 1 else one_harmonic(family, periods)
    largest = float(held[:, 1].max(initial=0.0)) or float(np.median(own.sizes))
    resonance = _crossings(own.in_phase, own)
    resonance = resonance[resonance[:, 1] <= _LARGEST_FREE * largest]
    # Beside the smallest motion of the branch, which is a subharmonic's forced part.
    small = np.linalg.norm(unknowns[:, :2], axis=1)

    def beside(share: np.ndarray, size: np.ndarray) -> OrbitStarts:
        """Spread states around the branch."""
        frequency = np.interp(share, own.shares, own.frequency)
        phase = np.tile(2.0 * np.pi / _DIRECTIONS * np.arange(_DIRECTIONS), share.size)
        share, size, frequency = (np.repeat(values, _DIRECTIONS) for values in (share, size, frequency))
        apart = np.abs(unknowns[:, -1] - share[:, None])
        near = apart <= apart.min(axis=1, keepdims=True) + _NEARBY
        states = unknowns[np.argmin(np.where(near, small, np.inf), axis=1), :-1] * scale
        states[:, 0] += size * np.cos(phase)
        states[:, 1] -= size * 2.0 * np.pi * frequency / periods * np.sin(phase)
        return OrbitStarts(share, states, size)

    def evenly(places: np.ndarray, count: int) -> np.ndarray:
        places = places[np.argsort(places[:, 1])]
        return places[np.unique(np.linspace(0, len(places) - 1, min(count, len(places))).astype(int))]

    parts = [beside(*evenly(resonance, _ALONG_RESONANCE).T)] if len(resonance) else []
    allowed = np.concatenate([held, resonance])
    for share in (np.arange(PLACES) + 0.5) / PLACES:
        near = allowed[np.abs(allowed[:, 0] - share) <= 1.0 / PLACES, 1]
        near = near if near.size else np.array([largest])
        radii = np.geomspace(_NEAREST * near.min(), _FARTHEST * near.max(), _RADII)
        parts.append(beside(np.full(_RADII, share), radii))
    if periods == 1:
        shares = own.shares[:: _SHARE_COUNT // PLACES]
        balanced = held[np.isin(held[:, 0], shares)]
        share, size = np.concatenate([balanced, _resonance_peaks(own)]).T
        if share.size:
            states = np.asarray(_balanced_states(family, jnp.asarray(share), jnp.asarray(size)))
            parts.append(OrbitStarts(share, states, size))
    return OrbitStarts(*(np.concatenate(own) for own in zip(*parts, strict=True)))
