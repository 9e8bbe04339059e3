"""The balance of forces over all records by one linear least squares, and the delay at which it closes."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import no_type_check

import numpy as np
import scipy
from jaxtyping import Complex, Float, Int

from ._lines import Lines

_GROUPS = 16
"""Groups of lines, each left out once, from which the errors come."""

_LONGEST_DELAY = 0.5
"""Delays up to so many seconds, over the whole file, are tried."""

_STEPS_A_PERIOD = 10.0
"""Delays tried a period of the fastest line."""

_MOST_DELAYS = 400
"""Delays that are tried at most."""

_FEWEST_DELAYS = 40
"""And at least."""

_ZERO = 1e-10
"""Singular values below this share of the largest count as zero: laws that the records cannot separate."""


@dataclass(frozen=True)
class Balance:
    """How the forces balance.

    Attributes:
        inertia: apparent mass over the declared one [1]; NaN where the balance has no inertia.
        inertia_error: its standard error.
        power: mean power of the drive over the sum of its magnitudes [1].
        power_error: its standard error.
        unexplained: rms of what no law balances, over that of the target [1].
    """

    inertia: float
    inertia_error: float
    power: float
    power_error: float
    unexplained: float


@dataclass(frozen=True, eq=False)
class Rows:
    """The lines of all records, each record weighted by the rms of its target.

    Attributes:
        target: what the laws must add up to.
        push: what feeds power in.
        laws: their columns, each of unit rms.
        norms: rms of each column before, over that of the target.
        velocity: its lines, for the power.
        omega: angular frequency [rad/s].
        middle: time [s] since the start of the file.
        group: which group a line belongs to.
        has_inertia: whether the first law is the inertia.
    """

    target: Complex[np.ndarray, " line"]
    push: Complex[np.ndarray, " line"]
    laws: Complex[np.ndarray, "line law"]
    norms: Float[np.ndarray, " law"]
    velocity: Complex[np.ndarray, " line"]
    omega: Float[np.ndarray, " line"]
    middle: Float[np.ndarray, " line"]
    group: Int[np.ndarray, " line"]
    has_inertia: bool

    @cached_property
    def matrix(self) -> Float[np.ndarray, "row law"]:
        """Real and imaginary parts of the laws."""
        return _stacked(self.laws)

    @cached_property
    def directions(self) -> Float[np.ndarray, "row direction"]:
        """Orthonormal columns that span the laws."""
        left, size, _ = np.linalg.svd(self.matrix, full_matrices=False)
        return left[:, size > _ZERO * size[0]]

    @no_type_check  # called a hundred thousand times by those who are checked
    def unexplained(self, lag: Float[np.ndarray, " line"] | float) -> float:
        """Gives the share of the target, acting so many seconds earlier, that the laws leave."""
        target = _stacked(self.target * np.exp(1j * self.omega * lag))
        explained = float(np.sum((self.directions.T @ target) ** 2))
        return float(np.sqrt(max(0.0, 1.0 - explained / float(target @ target))))


@no_type_check
def _stacked(lines: Complex[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    return np.concatenate([np.real(lines), np.imag(lines)])


def rows_of(records: list[Lines], has_inertia: bool) -> Rows | None:
    """Gives the rows of all records.

    Args:
        records: The lines of each.
        has_inertia: Whether the first law is the inertia.

    Returns:
        The rows; None where they are fewer than twice the laws, with which anything balances.
    """
    live = [one for one in records if one.omega.size and np.any(one.target)]
    if not live or 2 * sum(one.omega.size for one in live) < 2 * live[0].laws.shape[1]:
        return None
    sizes = [float(np.sqrt(np.mean(np.abs(one.target) ** 2))) for one in live]

    def joined(read: Callable[[Lines], Complex[np.ndarray, "..."]]) -> Complex[np.ndarray, "..."]:
        return np.concatenate([read(one) / size for one, size in zip(live, sizes, strict=True)])

    laws = joined(lambda one: one.laws)
    norms = np.sqrt(np.mean(np.abs(laws) ** 2, axis=0)) + 1e-300
    share = max(2, round(_GROUPS / len(live)))
    groups = [
        place * share + np.arange(one.omega.size) * share // one.omega.size for place, one in enumerate(live)
    ]
    return Rows(
        joined(lambda one: one.target),
        joined(lambda one: one.push),
        laws / norms,
        norms,
        joined(lambda one: one.velocity),
        np.concatenate([one.omega for one in live]),
        np.concatenate([one.middle for one in live]),
        np.concatenate(groups),
        has_inertia,
    )


def find_balance(rows: Rows, mass: float, lag: Float[np.ndarray, " line"] | float = 0.0) -> Balance:
    """Gives how the forces balance: `F = m a + springs + dampers`, by least squares.

    The errors are those of the jackknife over groups of lines: what the laws lack counts as well as noise.

    Args:
        rows: The lines.
        mass: As declared [kg]; 1 where the balance is per mass.
        lag: By how much earlier the drive acts than it is recorded [s].

    Returns:
        The balance.

    Source: Masri & Caughey 1979; B. Efron, The Jackknife, 1982.
    """
    turn = np.exp(1j * rows.omega * lag)
    target, matrix = _stacked(rows.target * turn), rows.matrix
    power = np.real(rows.push * turn * np.conj(rows.velocity))
    size = np.abs(rows.push) * np.abs(rows.velocity)
    groups = [np.flatnonzero(rows.group == one) for one in np.unique(rows.group)]
    places = [np.concatenate([group, group + rows.omega.size]) for group in groups]
    products = np.stack([matrix[place].T @ matrix[place] for place in places])
    sides = np.stack([matrix[place].T @ target[place] for place in places])
    powers = np.stack([[np.sum(power[group]), np.sum(size[group])] for group in groups])
    whole, side, both = products.sum(axis=0), sides.sum(axis=0), powers.sum(axis=0)

    def inertia(gram: Float[np.ndarray, "law law"], right: Float[np.ndarray, " law"]) -> float:
        return float(np.linalg.lstsq(gram, right, rcond=_ZERO)[0][0] / rows.norms[0] / mass)

    apparent, errors = float("nan"), [float("nan")]
    if rows.has_inertia:
        apparent = inertia(whole, side)
        errors = [
            inertia(whole - own, side - its) - apparent for own, its in zip(products, sides, strict=True)
        ]
    shares = (both[0] - powers[:, 0]) / np.maximum(both[1] - powers[:, 1], 1e-300)
    factor = float(both[0] / max(both[1], 1e-300))
    return Balance(
        inertia=apparent,
        inertia_error=_jackknife(np.array(errors)),
        power=factor,
        power_error=_jackknife(shares - factor),
        unexplained=rows.unexplained(lag),
    )


def _jackknife(deviations: Float[np.ndarray, " group"]) -> float:
    return float(np.sqrt((deviations.size - 1) * np.mean(deviations**2)))


def find_lag(rows: Rows, course: Float[np.ndarray, " line"]) -> float:
    """Gives the largest lag, of a course over the lines, with which the balance closes best.

    Args:
        rows: The lines.
        course: How the lag runs over the lines: 1 for a delay, the time for a clock that runs fast.

    Returns:
        The factor of the course: the delay [s], or the skew [1].
    """
    step = 2 * np.pi / (_STEPS_A_PERIOD * float(np.max(rows.omega)))
    count = int(np.clip(round(_LONGEST_DELAY / step), _FEWEST_DELAYS // 2, _MOST_DELAYS // 2))
    factors = np.arange(-count, count + 1) * (step / float(np.max(course)))
    best = int(np.argmin([rows.unexplained(factor * course) for factor in factors]))
    width = factors[1] - factors[0]
    found = scipy.optimize.minimize_scalar(
        lambda factor: rows.unexplained(factor * course),
        bounds=(factors[best] - width, factors[best] + width),
        method="bounded",
        options={"xatol": 1e-3 * width},
    )
    return float(found.x)
