"""Draw the signatures of plain springs and dampers, and of the errors of gain and zero.

python docs/effects/draw_basic.py
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from panels import label
from scipy.integrate import solve_ivp

from isojax.reporting.plots._style import AFTER, BEFORE, LEVELS, NEUTRAL, axes_for, entitle

HERE = Path(__file__).parent
PHASE = 2.0 * np.pi * np.arange(1024) / 1024
LARGEST, SPEED = 3e-3, 0.09
SIZE = np.linspace(0.02, 1.0, 80)
MASS, K1, K3, C1 = 800.0, 1.08e6, 6e10, 1.0e4
Law = Callable[[np.ndarray, np.ndarray], np.ndarray]

SPRINGS: tuple[tuple[str, str, Law], ...] = (
    ("linear, k1 x", NEUTRAL, lambda x, v: 1e6 * x),
    ("|x|x", LEVELS[1], lambda x, v: 1e6 * np.abs(x) * x / LARGEST),
    ("cubic, x^3", AFTER, lambda x, v: 1e6 * x**3 / LARGEST**2),
    ("quadratic, x^2", BEFORE, lambda x, v: 1e6 * x**2 / LARGEST),
)
DAMPERS: tuple[tuple[str, str, Law], ...] = (
    ("linear, c1 v", NEUTRAL, lambda x, v: 1e4 * v),
    ("|v|v", LEVELS[1], lambda x, v: 1e4 * np.abs(v) * v / SPEED),
    ("cubic, v^3", AFTER, lambda x, v: 1e4 * v**3 / SPEED**2),
    ("position, x^2 v", BEFORE, lambda x, v: 1e4 * x**2 * v / LARGEST**2),
)


def panels(*titles: str) -> tuple[Figure, list[Axes]]:
    """Axes side by side with their titles."""
    figure = Figure(figsize=(3.3 * len(titles), 2.9), layout="constrained")
    axes = [axes_for(ax)[1] for ax in figure.subplots(1, len(titles))]
    for ax, title in zip(axes, titles, strict=True):
        entitle(ax, title)
    return figure, axes


def cycle(law: Law, share: float) -> np.ndarray:
    """Force over a cycle of a share of the largest motion [N]."""
    return law(share * LARGEST * np.sin(PHASE), share * SPEED * np.cos(PHASE))


def springs() -> Figure:
    """Force over displacement, and stiffness and mean force over amplitude."""
    figure, (first, second, third) = panels("force", "equivalent stiffness", "mean force")
    x = np.linspace(-LARGEST, LARGEST, 200)
    for name, colour, law in SPRINGS:
        first.plot(1e3 * x, law(x, 0.0 * x), color=colour, label=name)
        forces = [cycle(law, share) for share in SIZE]
        stiffness = [
            2.0 * np.mean(f * np.sin(PHASE)) / s for f, s in zip(forces, SIZE * LARGEST, strict=True)
        ]
        second.plot(1e3 * SIZE * LARGEST, 1e-3 * np.array(stiffness), color=colour)
        third.plot(1e3 * SIZE * LARGEST, np.mean(forces, axis=1), color=colour)
    label(first, "displacement [mm]", "force [N]")
    label(second, "amplitude [mm]", "stiffness [kN/m]")
    label(third, "amplitude [mm]", "mean force [N]")
    return figure


def dampers() -> Figure:
    """Force over velocity, and damping over amplitude and over frequency."""
    figure, (first, second, third) = panels("force", "damping over amplitude", "damping over frequency")
    for name, colour, law in DAMPERS:
        force = cycle(law, 1.0)
        first.plot(1e3 * SPEED * np.cos(PHASE), force, color=colour, label=name)
        of = [2.0 * np.mean(cycle(law, share) * np.cos(PHASE)) / (share * SPEED) for share in SIZE]
        second.plot(1e3 * SIZE * LARGEST, 1e-3 * np.array(of), color=colour)
        faster = np.linspace(0.2, 1.5, 40)
        over = [
            2.0
            * np.mean(law(LARGEST * np.sin(PHASE), f * SPEED * np.cos(PHASE)) * np.cos(PHASE))
            / (f * SPEED)
            for f in faster
        ]
        third.plot(faster * SPEED / LARGEST / (2.0 * np.pi), 1e-3 * np.array(over), color=colour)
    label(first, "velocity [mm/s]", "force [N]")
    label(second, "amplitude [mm]", "damping [kN s/m]")
    label(third, "frequency at 3 mm [Hz]", "damping [kN s/m]")
    return figure


def gains() -> Figure:
    """One receptance, three causes: what each leaves of the coefficients."""
    figure, (left, right) = panels("mass, force or reading: one curve", "fitted over true, each 8 % off")
    f = np.linspace(3.0, 9.0, 200)
    omega = 2.0 * np.pi * f
    inertance = omega**2 / np.abs(K1 - MASS * omega**2 + 1j * omega * C1)
    left.plot(f, 1e3 * inertance, color=NEUTRAL, label="as it is")
    left.plot(f, 1.08e3 * inertance, color=AFTER, lw=3.0, label="acting force 8 % larger")
    left.plot(f, 1.08e3 * inertance, "--", color=BEFORE, label="reading 8 % larger")
    label(left, "frequency [Hz]", "acceleration / force [mm/s^2/N]")
    # The motion X is seen as gX where the sensor reads g: a force k X^p then fits k / g^p; with the force too
    # small by g every coefficient is. The mass is declared, so the scale is that of an added mass.
    places = np.arange(4)
    names = ("k1, c1", "k2, c2", "k3, c3", "mass")
    force_error = np.full(4, 1.0 / 1.08)
    sensor_error = np.array([1.0 / 1.08, 1.08**-2, 1.08**-3, 1.0 / 1.08])
    right.bar(places - 0.2, force_error, 0.36, color=AFTER, label="input_gain = 0.08")
    right.bar(places + 0.2, sensor_error, 0.36, color=BEFORE, label="sensor_gain = 0.08")
    right.axhline(1.0, color=NEUTRAL, linewidth=0.8)
    right.set_ylim(0.75, 1.06)
    right.set_xticks(places, names)
    label(right, "coefficient, all of them fitted", "fitted / true")
    return figure


def steady(offset: float, amplitude: float) -> np.ndarray:
    """A cycle of displacement of a hardening isolator under a sine and a constant, by SciPy [m]."""
    omega = 2.0 * np.pi * 4.5

    def field(t: float, y: np.ndarray) -> tuple[float, float]:
        x, v = y
        return v, (amplitude * np.sin(omega * t) + offset - K1 * x - 10.0 * K3 * x**3 - C1 * v) / MASS

    period = 2.0 * np.pi / omega
    times = 20.0 * period + period * np.arange(256) / 256
    return solve_ivp(field, (0.0, times[-1]), (0.0, 0.0), "DOP853", times, rtol=1e-9, atol=1e-12).y[0]


def offsets() -> Figure:
    """Both move the mean; a force also bends the motion."""
    figure, (left, right) = panels("mean of the motion or reading", "second harmonic")
    amplitude = np.linspace(20.0, 400.0, 10)
    lines = np.array([np.fft.rfft(steady(60.0, one))[:3] / 256 for one in amplitude])
    plain = np.array([np.fft.rfft(steady(0.0, one))[:3] / 256 for one in amplitude])
    left.plot(amplitude, 1e6 * lines[:, 0].real, "o-", color=AFTER, markersize=3, label="input offset, 60 N")
    level = 1e6 * lines[0, 0].real
    left.plot(amplitude, level + 0.0 * amplitude, color=BEFORE, label=f"sensor offset, {level:.0f} um")
    left.set_ylim(0.0, 1.3 * level)
    right.plot(amplitude, 2e6 * np.abs(lines[:, 2]), "o-", color=AFTER, markersize=3, label="input offset")
    right.plot(amplitude, 2e6 * np.abs(plain[:, 2]), color=BEFORE, label="sensor offset")
    label(left, "force amplitude [N]", "mean [um]")
    label(right, "force amplitude [N]", "amplitude [um]")
    return figure


def main() -> None:
    """Draw every picture beside its pages."""
    for picture in (springs, dampers, gains, offsets):
        picture().savefig(HERE / f"{picture.__name__}.png", dpi=110)


if __name__ == "__main__":
    main()
