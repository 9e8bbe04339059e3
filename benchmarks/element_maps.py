"""Map the paper's y model beside each element that has a period map, and compare cells with the rig's orbits.

Run: python benchmarks/element_maps.py [ELEMENT ...]

For each element: cells of a 20 x 20 map that are empty and how many of these a single orbit fills; the error
of the multipliers of the map, and of single orbits, against orbits of the rig (`rig_orbits.py` in
tests/stability), beside the errors that both report; cells with several orbits, and of the orbits in a few of
them those that the rig does not confirm; motions to which the rig settles, from rest and from a large
displacement under large drives, that the map of these drives lacks, apart from those about another rest,
which the map names; time, compiling apart.
Marks: no cell is empty where a single orbit converges; no error exceeds the reported one, unless the result
says that the accuracy was not reached; no motion about the rest of the map is lacking. The exit status is 1
after a FAIL.
"""

import argparse
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, no_type_check

import jax

jax.config.update("jax_enable_x64", True)

import numpy as np  # noqa: E402  (float64 first)

import isojax as ij  # noqa: E402
from isojax import elements as el  # noqa: E402
from isojax import rig  # noqa: E402

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "stability"))
from rig_orbits import after_a_period, displacements_of_a_period, multiplier_error, rig_orbit  # noqa: E402  (path first)

AMPLITUDES = np.linspace(5.0, 60.0, 20)
FREQUENCIES = np.linspace(4.0, 8.0, 20)
"""[N], [Hz]: resonance lies at 5.85 Hz, where 60 N move the mass by 0.15 mm."""

LARGE, BESIDE = np.array([60.0, 160.0, 300.0]), np.array([4.0, 4.3, 5.0, 6.0, 7.0, 8.0])
"""Drives under which the model bends [N], and frequencies on both sides of resonance [Hz]."""

FAR, PERIODS, SETTLED, SAME = 2.0, 150, 1e-6, 1e-3
"""Displacement of the second start over the largest of the map; drive periods at most until a motion settles;
change over a period, and distance from an orbit of the map, that count as none, over the size of a motion."""

SAMPLED, EMPTY_TRIED, SEVERAL_TRIED = 8, 40, 2
"""Cells compared with the rig, empty cells tried one by one, and cells of several orbits looked at."""

ROUNDING = 1e-8
"""What an error may exceed the reported one by: the rig's differences are no better."""

SKIPPED = {
    "acts on the response channel alone": ("clipping", "sensor_gain", "sensor_offset", "mains_hum"),
    "acts on the samples of a drive": ("input_hold", "clock_skew"),
    "follows a signal of a record": (
        "floor_motion",
        "stiffness_drift",
        "damping_drift",
        "pressure_stiffness",
        "pressure_damping",
        "pressure_cubic_stiffness",
        "temperature_stiffness",
        "temperature_damping",
    ),
}


@dataclass(frozen=True)
class Branches(rig.Law):
    """Maxwell branches of given rates beside a spring and a dashpot: the law that the element declares."""

    name: ClassVar[str] = "branches"
    inner: ClassVar[int] = 6
    order: float
    size: float
    lowest: float
    highest: float

    @no_type_check
    def _rates(self):
        return [self.lowest * (self.highest / self.lowest) ** (place / 5.0) for place in range(6)]

    @no_type_check
    def force(self, t, x, v, z, s):
        step = np.log(self.highest / self.lowest) / 5.0
        spring = self.lowest**self.order / np.expm1(self.order * step)
        dashpot = self.highest ** (self.order - 1.0) / np.expm1((1.0 - self.order) * step)
        shares = sum(rate**self.order * own for rate, own in zip(self._rates(), z, strict=True))
        whole = self.size * np.sin(np.pi * self.order) / np.pi * step
        return whole * (spring * x + dashpot * v + shares)

    @no_type_check
    def rate(self, t, x, v, z, s):
        return tuple(v - rate * own for rate, own in zip(self._rates(), z, strict=True))


@no_type_check
def _pressure(x, v, z):
    return z[0]


@dataclass(frozen=True)
class Line(rig.Law):
    """Two chambers joined by a line, in the element's own state: p' = v - q, p = tau q + o |q| q."""

    name: ClassVar[str] = "line"
    inner: ClassVar[int] = 1
    stiffness: float
    time_constant: float
    orifice: float

    @property
    def switches(self):
        return (_pressure,)

    @no_type_check
    def force(self, t, x, v, z, s):
        return self.stiffness * z[0]

    @no_type_check
    def rate(self, t, x, v, z, s):
        root = np.sqrt(max(self.time_constant**2 + 4.0 * self.orifice * s[0] * z[0], 0.0))
        return (v - 2.0 * z[0] / (self.time_constant + root),)


@dataclass(frozen=True)
class Push(rig.Law):
    """A constant force on the mass [N]."""

    name: ClassVar[str] = "push"
    value: float

    @no_type_check
    def force(self, t, x, v, z, s):
        return -self.value


class Case(NamedTuple):
    """An element at a strength, and the laws of the rig that stand for it.

    Attributes:
        elements: added to the y model.
        laws: added to the rig, or what changes the shape of its drive.
        inner: internal states of the rig from the state of the model.
        gain: of the drive.
        more: multipliers that the rig lacks, from the period [s].
    """

    elements: tuple
    laws: tuple[rig.Law | rig.DriveHarmonics, ...] = ()
    inner: Callable[[np.ndarray], Any] = lambda y0: y0[2:]
    gain: float = 1.0
    more: Callable[[float], list] = lambda period: []


OMEGA, SIZE = 2.0 * np.pi * 6.0, 1e-4
"""Typical angular frequency [rad/s] and displacement [m] of the window."""

WIDTH, CORNER = 1e-4, 1e-6
"""Declared rounding of friction [m/s] and of corners [m]."""

SPECTRUM = (OMEGA / 40.0, OMEGA * 12.0)

CASES: dict[str, Case] = {
    "linear_stiffness": Case((el.LinearStiffness(2e5),), (rig.LinearStiffness(2e5),)),
    "abs_quadratic_stiffness": Case((el.AbsQuadraticStiffness(-8e8),), (rig.AbsQuadraticStiffness(-8e8),)),
    "cubic_stiffness": Case((el.CubicStiffness(5e12),), (rig.CubicStiffness(5e12),)),
    "quadratic_stiffness": Case((el.QuadraticStiffness(2e9),), (rig.QuadraticStiffness(2e9),)),
    "quintic_stiffness": Case((el.QuinticStiffness(5e20),), (rig.QuinticStiffness(5e20),)),
    "polytropic_gas": Case(
        (el.PolytropicGas(700.0, 2e-3, 1.4, 1.0),), (rig.PolytropicGas(700.0, 2e-3, 1.4, 1.0),)
    ),
    "linear_damping": Case((el.LinearDamping(-5e3),), (rig.LinearDamping(-5e3),)),
    "abs_quadratic_damping": Case((el.AbsQuadraticDamping(1e6),), (rig.AbsQuadraticDamping(1e6),)),
    "cubic_damping": Case((el.CubicDamping(3e8),), (rig.CubicDamping(3e8),)),
    "position_damping": Case((el.PositionDamping(1e12),), (rig.PositionDamping(1e12),)),
    "added_mass": Case((el.AddedMass(150.0),), (rig.AddedMass(150.0),)),
    "input_gain": Case((el.InputGain(0.2),), gain=1.2),
    "input_offset": Case((el.InputOffset(10.0),), (Push(10.0),)),
    "input_delay": Case((el.InputDelay(0.0),)),
    "drive_harmonics": Case(
        (el.DriveHarmonics(0.2, 0.7, 3.0), el.DriveHarmonics(0.1, -0.4, 2.0)),
        (rig.DriveHarmonics(0.2, 0.7, 3.0), rig.DriveHarmonics(0.1, -0.4, 2.0)),
    ),
    "ac_coupling": Case(
        (el.AcCoupling(0.5, 0.1),),
        inner=lambda y0: [],
        more=lambda period: [np.exp(-2.0 * np.pi * 0.6 * period)],
    ),
    "maxwell_branch": Case((el.MaxwellBranch(3e5, 0.03),), (rig.MaxwellBranch(3e5, 0.03),)),
    "dual_chamber": Case((el.DualChamber(3e5, 0.02, 5.0),), (Line(3e5, 0.02, 5.0),)),
    "fractional_damping": Case(
        (el.FractionalDamping(3e4, 0.4, *SPECTRUM),), (Branches(0.4, 3e4, *SPECTRUM),)
    ),
    "second_mode": Case(
        (el.SecondMode(60.0, 40.0, 0.03),),
        (rig.SecondMode(60.0, 40.0 / (2.0 * np.pi), 0.03),),
        inner=lambda y0: [y0[0] - y0[2], y0[3]],
    ),
    "bouc_wen": Case((el.BoucWen(2.7e5, 1e4, -5e3, 1.0),), (rig.BoucWen(2.7e5, 1e4, -5e3, 1.0),)),
    "dahl_friction": Case(
        (el.DahlFriction(8.0, 3e-5),), (rig.DahlFriction(8.0, 8.0 / 3e-5),), inner=lambda y0: 8.0 * y0[2:]
    ),
    "lugre_friction": Case(
        (el.LugreFriction(6.0, 1e-5, 0.5, 1e-3, 1e-3),),
        (rig.LugreFriction(6.0, 9.0, 1e-3, 6.0 / 1e-5, 1e-3 * 6.0 / 1e-5),),
        inner=lambda y0: 1e-5 * y0[2:],
    ),
    "coulomb_friction": Case((el.CoulombFriction(4.0, WIDTH),), (rig.CoulombFriction(4.0),)),
    "coulomb_friction on a stiffening spring": Case(
        (el.CoulombFriction(12.0, WIDTH), el.CubicStiffness(2e12)),
        (rig.CoulombFriction(12.0), rig.CubicStiffness(2e12)),
    ),
    "asymmetric_friction": Case(
        (el.CoulombFriction(4.0, WIDTH), el.AsymmetricFriction(1.5, WIDTH)),
        (rig.CoulombFriction(4.0), rig.AsymmetricFriction(1.5)),
    ),
    "stribeck_friction": Case(
        (el.StribeckFriction(3.0, 0.5, 1e-3, WIDTH),), (rig.StribeckFriction(3.0, 0.5, 1e-3),)
    ),
    "end_stop": Case((el.EndStop(2e6, 6e-5, 0.0, CORNER),), (rig.EndStop(2e6, 6e-5, 0.0),)),
    "end_stop on one side": Case((el.EndStop(1e6, 6e-5, 1.0, CORNER),), (rig.EndStop(2e6, 6e-5, 1.0),)),
    "freeplay": Case((el.Freeplay(5e5, 4e-5, CORNER),), (rig.Freeplay(5e5, 4e-5),)),
}


class Row(NamedTuple):
    """What one element's map shows."""

    empty: int
    filled: int
    error: float
    reported: float
    single: float
    single_reported: float
    unconfirmed: int
    several: int
    settled: int
    elsewhere: int
    lacking: int
    compiling: float
    cell: float

    @property
    def passed(self) -> bool:
        """Whether all marks are met."""
        within = self.error <= self.reported + ROUNDING and self.single <= self.single_reported + ROUNDING
        return not (self.filled or self.unconfirmed or self.lacking) and within


def plant_of(case: Case) -> rig.Plant:
    """Give the rig of a case."""
    return rig.y_plant().plus(*case.laws)


def reference(case: Case, force: float, frequency: float, y0: np.ndarray) -> tuple[np.ndarray, bool]:
    """Give the multipliers of the rig's orbit next to a state, and whether it closed."""
    start = np.array([*y0[:2], *case.inner(y0)])
    orbit = rig_orbit(plant_of(case), case.gain * force, frequency, start)
    return np.array([*orbit.multipliers, *case.more(1.0 / frequency)]), orbit.closed


def single_orbit(model: Any, force: float, frequency: float) -> Any:
    """Give the orbit that a user would get, or None."""
    orbit = ij.find_periodic_orbit(model, ij.Harmonic(force, frequency))
    return orbit if ij.is_successful(orbit.result) else None


def look_at(case: Case, seed: int) -> Row:
    """Map one element and compare."""
    model = ij.paper.y_direction().with_elements(*case.elements)
    begun = time.perf_counter()
    ij.stability_map(model, AMPLITUDES * 1.001, FREQUENCIES)
    first = time.perf_counter() - begun
    begun = time.perf_counter()
    smap = ij.stability_map(model, AMPLITUDES, FREQUENCIES)
    again = time.perf_counter() - begun
    radius, random = np.asarray(smap.spectral_radius), np.random.default_rng(seed)
    empty = random.permutation(np.argwhere(~np.isfinite(radius)))
    filled = [
        cell
        for cell in empty[:EMPTY_TRIED]
        if single_orbit(model, AMPLITUDES[cell[0]], FREQUENCIES[cell[1]]) is not None
    ]
    full, starts = random.permutation(np.argwhere(np.isfinite(radius))), np.asarray(smap.y0)
    error, single, single_reported = 0.0, 0.0, 0.0
    for row, column in full[:SAMPLED]:
        at = float(AMPLITUDES[row]), float(FREQUENCIES[column])
        orbit = single_orbit(model, *at)
        start = starts[row, column] if orbit is None else np.asarray(orbit.y0)
        exact, closed = reference(case, *at, start)
        if not closed:
            print(f"      the rig's orbit at {at} did not close", flush=True)
            continue
        error = max(error, multiplier_error(np.asarray(smap.multipliers)[row, column], exact))
        if orbit is not None:
            single = max(single, multiplier_error(np.asarray(orbit.floquet.multipliers), exact))
            single_reported = max(single_reported, float(orbit.error))
    several, unconfirmed = coexisting(case, model)
    settled, elsewhere, lacking = motions_lacking(case, model)
    reported = float(smap.error) if np.isfinite(smap.error) else np.inf
    spent = again / radius.size
    return Row(
        len(empty),
        len(filled),
        error,
        reported,
        single,
        single_reported,
        unconfirmed,
        several,
        settled,
        elsewhere,
        lacking,
        first - again,
        spent,
    )


def coexisting(case: Case, model: Any) -> tuple[int, int]:
    """Give the cells with several orbits, and of a few how many the rig does not confirm."""
    smap = ij.stability_map(model, AMPLITUDES, FREQUENCIES, coexisting=True)
    count, unconfirmed = np.asarray(smap.count), 0
    cells = np.argwhere(count > 1)
    if not len(cells):
        return 0, 0
    starts = np.asarray(smap.y0)
    for row, column in cells[:: max(1, len(cells) // SEVERAL_TRIED)][:SEVERAL_TRIED]:
        at, found = (float(AMPLITUDES[row]), float(FREQUENCIES[column])), []
        for y0 in starts[:, row, column]:
            if not np.isfinite(y0).all():
                continue
            start = np.array([*y0[:2], *case.inner(y0)])
            orbit = rig_orbit(plant_of(case), case.gain * at[0], at[1], start)
            scale = np.array([1.0, 2.0 * np.pi * at[1]]) * np.abs(starts[:, row, column, 0]).max()
            new = all(np.max(np.abs(orbit.y0[:2] - other) / scale) > 1e-6 for other in found)
            unconfirmed += not (orbit.closed and new)
            found.append(orbit.y0[:2])
    return len(cells), unconfirmed


def motions_lacking(case: Case, model: Any) -> tuple[int, int, int]:
    """Give how many motions the rig settles to under large drives, and how many of these the map lacks: about
    another rest, which the map names, and about its own.
    """
    smap = ij.stability_map(model, LARGE, BESIDE, coexisting=True)
    starts, largest = np.asarray(smap.y0), float(np.nanmax(np.asarray(smap.response)))
    rests = smap.other_rests
    settled = elsewhere = lacking = 0
    for row, column in np.ndindex(LARGE.size, BESIDE.size):
        known = starts[:, row, column]
        inner = len(case.inner(known[0]))
        known = known[np.isfinite(known).all(axis=1)]
        unit = np.array([1.0, 2.0 * np.pi * BESIDE[column]])
        for begin in (0.0, FAR * largest):
            motion = np.array([begin, 0.0, *np.zeros(inner)])
            for _ in range(PERIODS):
                before = motion
                try:
                    motion = after_a_period(plant_of(case), case.gain * LARGE[row], BESIDE[column], before)
                except RuntimeError:  # it ran away: the model softens
                    break
                size = max(np.max(np.abs(motion[:2]) / unit), 1e-300)
                if np.max(np.abs(motion - before)[:2] / unit) <= SETTLED * size:
                    settled += 1
                    apart = np.max(np.abs(known[:, :2] - motion[:2]) / unit, axis=1)
                    lost = bool(np.min(apart, initial=np.inf) > SAME * size)
                    at = case.gain * LARGE[row], BESIDE[column], motion
                    path = displacements_of_a_period(plant_of(case), *at)
                    # Whole on one side of the rest of the map, and on the way about another.
                    away = bool(np.all(path > 0.0) or np.all(path < 0.0))
                    away &= bool(np.any((rests > path.min()) & (rests < path.max())))
                    elsewhere, lacking = elsewhere + (lost and away), lacking + (lost and not away)
                    break
    return settled, elsewhere, lacking


def main() -> int:
    """Map all elements, or those named."""
    parser = argparse.ArgumentParser()
    parser.add_argument("element", nargs="*", help="names of cases; all if omitted")
    names = parser.parse_args().element or list(CASES)
    for why, skipped in SKIPPED.items():
        print(f"left out, {why}: {', '.join(skipped)}")
    left = set(el.CATALOGUE) - set(CASES) - {name for own in SKIPPED.values() for name in own}
    print(f"elements of the catalogue that neither list holds: {sorted(left) or 'none'}")
    print(
        f"{'element':<40}{'empty':>6}{'single':>7}{'error':>9}{'reported':>10}{'orbit':>9}{'reported':>10}"
        f"{'several':>8}{'wrong':>6}{'settled':>8}{'elsewhere':>10}{'lacking':>8}{'compile':>9}{'a cell':>9}"
    )
    failed = 0
    for name in names:
        # A row is the same whichever others are asked for.
        row = look_at(CASES[name], list(CASES).index(name))
        # What is compiled for one element serves no other, and many of them exhaust the memory maps.
        jax.clear_caches()
        failed += not row.passed
        print(
            f"{name:<40}{row.empty:>6}{row.filled:>7}{row.error:>9.1e}{row.reported:>10.1e}{row.single:>9.1e}"
            f"{row.single_reported:>10.1e}{row.several:>8}{row.unconfirmed:>6}{row.settled:>8}"
            f"{row.elsewhere:>10}{row.lacking:>8}"
            f"{row.compiling:>7.1f} s"
            f"{1e3 * row.cell:>6.2f} ms  {'PASS' if row.passed else 'FAIL'}",
            flush=True,
        )
    print(f"{len(names) - failed} of {len(names)} elements passed")
    return 1 if failed or left else 0


if __name__ == "__main__":
    sys.exit(main())
