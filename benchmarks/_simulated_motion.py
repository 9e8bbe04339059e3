"""Motion of an oscillator with one further law, in normalised form; no code is shared with the models.

The equation is `z'' + 2 zeta z' + z + hardening z^3 + g = drive`: mass and natural angular frequency are 1.
Sixteen Runge-Kutta steps go into a sample. A law with a corner or a jump is split there: the step ends
where the mass reverses, sticks, breaks loose or meets a stop. Between the points of its fine grid the drive
is the parabola through three of them. `compare_with_scipy` integrates the equation again, adaptively, from
its own form of each law.
"""

import functools
import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float
from numba import njit
from scipy.integrate import solve_ivp

from _marks import Marks

SAMPLES = 40
"""Samples a natural period."""

SUBSTEPS = 16
"""Steps a sample; the drive is known twice as often."""

FINE = 2 * SUBSTEPS
STEP = 2.0 * math.pi / (SAMPLES * SUBSTEPS)
MOST_EVENTS = 50
LOST = 1e6
"""Displacement beyond which the motion runs away."""

USUAL: dict[str, tuple[float, ...]] = {
    "nothing": (),
    "cubic_damping": (0.4,),
    "coulomb_friction": (0.3,),
    "dahl_friction": (0.3, 6.0),
    "maxwell_branch": (0.6, 1.0),
    "cubic_stiffness": (0.3,),
    "quadratic_stiffness": (0.05,),
    "end_stop": (5.0, 0.6),
    "abs_quadratic_damping": (0.4,),
    "position_damping": (0.4,),
    "quintic_stiffness": (0.3,),
    "bouc_wen": (0.5, 1.0, -0.5),
}
"""The laws with the numbers of the comparison with SciPy."""

LAWS = tuple(USUAL)
"""Their places are the codes of the simulation."""

_COULOMB, _DAHL, _STOP, _BOUC_WEN = (
    LAWS.index(name) for name in ("coulomb_friction", "dahl_friction", "end_stop", "bouc_wen")
)
_ABS_QUADRATIC = LAWS.index("abs_quadratic_damping")

Signal = Float[np.ndarray, " time"]


class Oscillator(NamedTuple):
    """An oscillator with one further law.

    Attributes:
        damping_ratio: zeta.
        hardening: coefficient of z^3 beside the law.
        stiffness: of the linear spring; 1 but where a derivative is wanted.
        law: its name.
        numbers: of the law: b of `b v^3`, `b |v| v` and `b z^2 v`; the force of Coulomb's law; slip force
            and stiffness of Dahl's; stiffness and time constant of a Maxwell branch; the coefficient of a
            power of z; stiffness and gap of end stops; stiffness, beta and gamma of Bouc and Wen's law.
    """

    damping_ratio: float
    hardening: float = 0.0
    stiffness: float = 1.0
    law: str = "nothing"
    numbers: tuple[float, ...] = ()


class Motion(NamedTuple):
    """Displacement, velocity and acceleration at the samples."""

    displacement: Signal
    velocity: Signal
    acceleration: Signal


class Lines(NamedTuple):
    """A sum of sines: `Re sum c_k exp(2 pi i k t / T)` with the time in samples.

    Attributes:
        period: T [samples].
        multiples: k.
        amplitudes: c_k.
    """

    period: int
    multiples: Float[np.ndarray, " line"]
    amplitudes: Complex[np.ndarray, " line"]


def drawn_lines(
    draw: np.random.Generator, band: tuple[float, float], period: int, rms: float, equal: bool
) -> Lines:
    """Draw the lines of a band.

    Args:
        draw: random numbers.
        band: lowest and highest frequency, in natural frequencies.
        period: of the sum [samples].
        rms: over that period.
        equal: amplitudes alike (a multisine), else Rayleigh's (normal noise).
    """
    multiples = np.arange(math.ceil(band[0] * period / SAMPLES), math.floor(band[1] * period / SAMPLES) + 1)
    sizes = np.ones(multiples.size) if equal else draw.rayleigh(size=multiples.size)
    sizes *= rms / np.sqrt(np.sum(sizes**2) / 2.0)
    return Lines(period, multiples, sizes * np.exp(2j * np.pi * draw.uniform(size=multiples.size)))


def on_fine_grid(lines: Lines, start: int, count: int) -> Signal:
    """Give a sum of sines on the fine grid of `count` samples from the sample `start` on."""
    size = lines.period * FINE
    spectrum = np.zeros(size // 2 + 1, complex)
    spectrum[lines.multiples] = 0.5 * size * lines.amplitudes
    places = start * FINE + np.arange((count - 1) * FINE + 1)
    return np.fft.irfft(spectrum, size)[places % size]


def fine_times(count: int) -> Signal:
    """Give the times of the fine grid [samples]."""
    return np.arange((count - 1) * FINE + 1) / FINE


@njit(cache=True)
def _forces(law, a, z, v, p, side, from_z, from_p):
    """Force of the law and rate of its internal state, smooth beyond the corner that bounds `side`."""
    if law == 1:
        return a[0] * v**3, 0.0
    if law == 2:
        return a[0] * side, 0.0
    if law == 3:
        return a[0] * (side - (side - from_p) * math.exp(-side * (z - from_z) * a[1] / a[0])), 0.0
    if law == 4:
        return a[0] * p, v - p / a[1]
    if law == 5:
        return a[0] * z**3, 0.0
    if law == 6:
        return a[0] * z * z, 0.0
    if law == 7:
        return a[0] * side * side * (z - side * a[1]), 0.0
    if law == 8:
        return a[0] * side * v * v, 0.0
    if law == 9:
        return a[0] * z * z * v, 0.0
    if law == 10:
        return a[0] * z**5, 0.0
    if law == 11:
        return a[0] * p, v * (1.0 - a[1] * side * p - a[2] * abs(p))
    return 0.0, 0.0


@njit(cache=True)
def _rates(law, a, base, drive, z, v, p, side, from_z, from_p):
    force, rate = _forces(law, a, z, v, p, side, from_z, from_p)
    return drive - base[0] * v - base[1] * z - base[2] * z**3 - force, rate


@njit(cache=True)
def _between(b0, bm, b1, share):
    return b0 + share * (4.0 * bm - 3.0 * b0 - b1 + share * (2.0 * b0 - 4.0 * bm + 2.0 * b1))


@njit(cache=True)
def _stepped(law, a, base, b0, bm, b1, t, h, z, v, p, side, from_z, from_p):
    """One Runge-Kutta step from the share t of a step to t + h."""
    d0, dm, d1 = _between(b0, bm, b1, t), _between(b0, bm, b1, t + h / 2.0), _between(b0, bm, b1, t + h)
    w = h * STEP
    a1, r1 = _rates(law, a, base, d0, z, v, p, side, from_z, from_p)
    z2, v2, p2 = z + w / 2.0 * v, v + w / 2.0 * a1, p + w / 2.0 * r1
    a2, r2 = _rates(law, a, base, dm, z2, v2, p2, side, from_z, from_p)
    z3, v3, p3 = z + w / 2.0 * v2, v + w / 2.0 * a2, p + w / 2.0 * r2
    a3, r3 = _rates(law, a, base, dm, z3, v3, p3, side, from_z, from_p)
    z4, v4, p4 = z + w * v3, v + w * a3, p + w * r3
    a4, r4 = _rates(law, a, base, d1, z4, v4, p4, side, from_z, from_p)
    return (
        z + w / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4),
        v + w / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4),
        p + w / 6.0 * (r1 + 2.0 * r2 + 2.0 * r3 + r4),
    )


@njit(cache=True)
def _room(law, a, z, v, side):
    """Distance from the corner that ends this side; negative beyond it."""
    if law == _STOP:
        return a[1] - abs(z) if side == 0.0 else side * z - a[1]
    if law == _COULOMB or law == _DAHL or law == _ABS_QUADRATIC or law == _BOUC_WEN:
        return side * v
    return 1.0


@njit(cache=True)
def _simulate(law, a, base, fine, count, z, v):
    out = np.full((count, 3), np.nan)
    p = side = from_z = from_p = 0.0
    if law == _DAHL or law == _ABS_QUADRATIC or law == _BOUC_WEN:
        side = 1.0 if fine[0] >= 0.0 else -1.0
    elif law == _COULOMB and abs(fine[0]) > a[0]:
        side = 1.0 if fine[0] >= 0.0 else -1.0
    for sample in range(count):
        drive = fine[sample * FINE]
        held = law == _COULOMB and side == 0.0
        acceleration = 0.0 if held else _rates(law, a, base, drive, z, v, p, side, from_z, from_p)[0]
        out[sample, 0], out[sample, 1], out[sample, 2] = z, v, acceleration
        if not abs(z) < LOST or sample == count - 1:
            break
        for sub in range(SUBSTEPS):
            place = sample * FINE + 2 * sub
            b0, bm, b1 = fine[place], fine[place + 1], fine[place + 2]
            t = 0.0
            for event in range(MOST_EVENTS):
                if law == _COULOMB and side == 0.0:
                    # Held: it breaks loose where the other forces exceed the friction.
                    spring = base[1] * z + base[2] * z**3
                    if abs(_between(b0, bm, b1, 1.0) - spring) <= a[0]:
                        break
                    low, high = t, 1.0
                    for _ in range(50):
                        middle = 0.5 * (low + high)
                        if abs(_between(b0, bm, b1, middle) - spring) <= a[0]:
                            low = middle
                        else:
                            high = middle
                    t = high
                    side = 1.0 if _between(b0, bm, b1, t) > spring else -1.0
                zn, vn, pn = _stepped(law, a, base, b0, bm, b1, t, 1.0 - t, z, v, p, side, from_z, from_p)
                if _room(law, a, zn, vn, side) >= 0.0 or event == MOST_EVENTS - 1:
                    z, v, p = zn, vn, pn
                    break
                low, high = 0.0, 1.0 - t
                for _ in range(50):
                    middle = 0.5 * (low + high)
                    zn, vn, _pn = _stepped(law, a, base, b0, bm, b1, t, middle, z, v, p, side, from_z, from_p)
                    if _room(law, a, zn, vn, side) >= 0.0:
                        low = middle
                    else:
                        high = middle
                z, v, p = _stepped(law, a, base, b0, bm, b1, t, high, z, v, p, side, from_z, from_p)
                t += high
                if law == _STOP:
                    side = 0.0 if side != 0.0 else (1.0 if z > 0.0 else -1.0)
                elif law == _COULOMB:
                    v = 0.0
                    others = _between(b0, bm, b1, t) - base[1] * z - base[2] * z**3
                    side = 0.0 if abs(others) <= a[0] else (1.0 if others > 0.0 else -1.0)
                else:
                    if law == _DAHL:
                        from_p = _forces(law, a, z, v, p, side, from_z, from_p)[0] / a[0]
                        from_z = z
                    v, side = 0.0, -side
    return out


def simulate(oscillator: Oscillator, fine: Signal, start: tuple[float, float] = (0.0, 0.0)) -> Motion:
    """Simulate from rest, or from a slight motion that only laws without a corner may have.

    Args:
        oscillator: what moves.
        fine: the drive on the fine grid.
        start: first displacement and velocity.

    Returns:
        The motion at the samples; not finite once it runs away.
    """
    numbers = np.array([*oscillator.numbers, 0.0, 0.0, 0.0])[:3]
    base = np.array([2.0 * oscillator.damping_ratio, oscillator.stiffness, oscillator.hardening])
    count = (fine.size - 1) // FINE + 1
    return Motion(*_simulate(LAWS.index(oscillator.law), numbers, base, fine, count, *start).T)


def _law_force(oscillator: Oscillator, z: float, v: float, p: float) -> tuple[float, float]:
    """Force and rate of the internal state, in the words of the literature; without Coulomb's law."""
    a = (*oscillator.numbers, 0.0, 0.0, 0.0)
    return {
        "nothing": lambda: (0.0, 0.0),
        "cubic_damping": lambda: (a[0] * v**3, 0.0),
        "coulomb_friction": lambda: (0.0, 0.0),
        "dahl_friction": lambda: (p, a[1] * (v - abs(v) * p / a[0])),
        "maxwell_branch": lambda: (a[0] * p, v - p / a[1]),
        "cubic_stiffness": lambda: (a[0] * z**3, 0.0),
        "quadratic_stiffness": lambda: (a[0] * z**2, 0.0),
        "end_stop": lambda: (a[0] * (max(z - a[1], 0.0) - max(-z - a[1], 0.0)), 0.0),
        "abs_quadratic_damping": lambda: (a[0] * abs(v) * v, 0.0),
        "position_damping": lambda: (a[0] * z**2 * v, 0.0),
        "quintic_stiffness": lambda: (a[0] * z**5, 0.0),
        "bouc_wen": lambda: (a[0] * p, v - a[1] * abs(v) * p - a[2] * v * abs(p)),
    }[oscillator.law]()


def check_laws(laws: Iterable[str]) -> None:
    """Compare the motion of each law with SciPy's over ten natural periods; end with code 1 after a FAIL."""
    lines = drawn_lines(np.random.default_rng(0), (0.3, 3.0), 40 * SAMPLES, 0.5, equal=True)
    marks = Marks()
    for law in laws:
        error = compare_with_scipy(Oscillator(0.06, 0.05, 1.0, law, USUAL[law]), lines, 0, 10 * SAMPLES)
        marks.judge(
            f"{law}: largest difference from SciPy {error:.1e} of the motion (mark 1e-5)", error < 1e-5
        )
    marks.leave()


def compare_with_scipy(oscillator: Oscillator, lines: Lines, start: int, count: int) -> float:
    """Give the largest difference from SciPy's motion over the largest displacement.

    Args:
        oscillator: what moves.
        lines: the drive.
        start: its first sample.
        count: samples.
    """
    angular = 2.0 * np.pi * lines.multiples / lines.period

    def drive(time: float) -> float:
        phases = np.exp(1j * angular * (start + time * SAMPLES / (2.0 * np.pi)))
        return float(np.real(lines.amplitudes @ phases))

    times = np.arange(count) * 2.0 * np.pi / SAMPLES
    ours = simulate(oscillator, on_fine_grid(lines, start, count)).displacement
    reference = _scipy_motion(oscillator, drive, times)
    return float(np.max(np.abs(ours - reference)) / np.max(np.abs(reference)))


def _scipy_motion(oscillator: Oscillator, drive: Callable[[float], float], times: Signal) -> Signal:
    """Integrate adaptively, from event to event where the mass reverses."""
    damping, hardening = 2.0 * oscillator.damping_ratio, oscillator.hardening
    level = oscillator.numbers[0] if oscillator.law == "coulomb_friction" else 0.0

    def others(time: float, z: float) -> float:
        return drive(time) - z - hardening * z**3

    def rates(direction: float) -> Callable:
        def given(time: float, state: Signal) -> tuple[float, float, float]:
            z, v, p = state
            force, rate = _law_force(oscillator, z, v, p)
            return v, others(time, z) - damping * v - force - level * direction, rate

        return given

    def reverses(time: float, state: Signal) -> float:
        return state[1]

    reverses.terminal = True  # pyright: ignore[reportFunctionMemberAccess]  (what solve_ivp reads)
    settings = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-12, "max_step": 0.05}
    moves = np.zeros(times.size)
    now, state = 0.0, np.zeros(3)
    while now < times[-1]:
        if level and abs(others(now, state[0])) <= level:
            end = _loose(functools.partial(others, z=state[0]), level, now, times[-1])
            moves[(times >= now) & (times <= end)] = state[0]
            now = end
            continue
        direction = math.copysign(1.0, others(now, state[0]))
        asked = times[times > now]
        # The event at the start of a piece must not end it: a short piece goes before without one.
        first = solve_ivp(rates(direction), (now, now + 1e-4), state, **settings)
        within = asked < first.t[-1]
        moves[np.flatnonzero(times > now)[within]] = state[0]
        now, state, asked = first.t[-1], first.y[:, -1], asked[~within]
        if not asked.size:
            break
        events = reverses if level else None
        run = solve_ivp(rates(direction), (now, times[-1]), state, t_eval=asked, events=events, **settings)
        moves[np.searchsorted(times, run.t)] = run.y[0]
        if run.status != 1:
            break
        now, state = run.t_events[0][0], run.y_events[0][0] * np.array([1.0, 0.0, 1.0])
    return moves


def _loose(others: Callable[[float], float], level: float, now: float, last: float) -> float:
    """Find when the other forces first exceed the friction; the last time if they do not."""
    ahead = now
    while abs(others(ahead)) <= level:
        ahead += 1e-3
        if ahead > last:
            return last
    low, high = ahead - 1e-3, ahead
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if abs(others(middle)) > level else (middle, high)
    return high
