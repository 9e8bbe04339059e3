"""Draw the signatures of the effects that are seen in records and spectra beside their pages of this folder.

python docs/effects/draw_records.py
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from panels import label, panels
from scipy import signal

from isojax import rig
from isojax.reporting.plots._style import AFTER, BEFORE, LEVELS, MEASURED, NEUTRAL

HERE = Path(__file__).parent
MASS, STIFFNESS, DAMPING = 800.0, 1.08e6, 1.0e4
RESONANCE = np.sqrt(STIFFNESS / MASS) / (2.0 * np.pi)
PLANT = rig.Plant((rig.LinearStiffness(STIFFNESS), rig.LinearDamping(DAMPING)), MASS)
_WINDOW = 400
"""Samples of a window that does not resolve the single tones of the floor."""

BENCH = rig.Bench(rate=250.0, noise=0.003, force_noise=0.0, drift=0.0, shaker=rig.IDEAL_SHAKER)


def receptance(frequency: np.ndarray, stiffness: float = STIFFNESS) -> np.ndarray:
    """Displacement over force [m/N]."""
    omega = 2.0 * np.pi * frequency
    return 1.0 / (stiffness - MASS * omega**2 + 1j * omega * DAMPING)


def transmissibility(frequency: np.ndarray) -> np.ndarray:
    """Motion of the mass over motion of the floor."""
    omega = 2.0 * np.pi * frequency
    return (STIFFNESS + 1j * omega * DAMPING) * receptance(frequency)


def input_hold() -> Figure:
    """One drive, three courses between its samples; what passes of a tone."""
    figure, left, right = panels("one set of samples, three drives", "what passes of a tone")
    time = np.linspace(0.0, 8.0, 801)
    samples = np.sin(2.0 * np.pi * np.arange(10) / 8.0)
    left.plot(time, np.sin(2.0 * np.pi * time / 8.0), color=AFTER, label="band-limited")
    left.plot(np.arange(9), samples[:9], color=LEVELS[2], label="linear")
    left.step(np.arange(9), samples[:9], where="post", color=BEFORE, label="zero-order")
    left.plot(np.arange(9), samples[:9], "o", color=MEASURED, markersize=3)
    label(left, "time [samples]", "drive over its amplitude")
    share = np.linspace(0.0, 0.5, 200)
    right.plot(share, np.ones_like(share), color=AFTER, label="band-limited")
    right.plot(share, np.sinc(share) ** 2, color=LEVELS[2], label="linear")
    right.plot(share, np.sinc(share), color=BEFORE, label="zero-order,\nhalf a sample late")
    right.set_ylim(0.0, 1.1)
    label(right, "frequency / sampling rate", "amplitude passed")
    return figure


def stiffness_drift() -> Figure:
    """The resonance moves; the residual grows with the clock, whatever the level."""
    figure, left, right = panels("the resonance moves during the test", "residual in the order of the test")
    change = 0.04 * STIFFNESS
    frequency = np.linspace(4.0, 8.0, 200)
    for when, colour in zip((0.0, 0.5, 1.0), LEVELS, strict=False):
        size = 1e6 * np.abs(receptance(frequency, STIFFNESS + change * when))
        left.plot(frequency, size, color=colour, label=f"{100 * when:.0f} % of the test")
    label(left, "frequency [Hz]", "displacement / force [um/N]")
    levels = (60.0, 120.0, 60.0, 120.0)
    for place, level in enumerate(levels):
        dwells = np.arange(8)
        clock = (place + (dwells + 0.5) / 8.0) / len(levels)
        tested = 4.5 + 0.35 * dwells
        left_over = level * np.abs(
            receptance(tested, STIFFNESS + change * clock) - receptance(tested, STIFFNESS)
        )
        colour = LEVELS[0] if level == 60.0 else LEVELS[2]
        name = f"{level:g} N" if place < 2 else None
        right.plot(100.0 * clock, 1e6 * left_over / level, "o-", color=colour, markersize=3, label=name)
    label(right, "time of the test [%]", "residual / drive [um/N]")
    return figure


def mains_hum() -> Figure:
    """A line of one height at every level, whose phase nothing locks to the record."""
    figure, left, right = panels("residual: one line at every level", "two records: the phase is free")
    plan = rig.SteppedSine((60.0, 120.0), (4.7,), 40, directions=("forward",))
    faster = rig.Bench(**{**vars(BENCH), "rate": 1000.0})
    noisy = rig.run(PLANT.plus(rig.MainsHum(0.01, 50.0)), plan, 3, faster)
    clean = rig.run(PLANT, plan, 3, rig.Bench(**{**vars(faster), "noise": 0.0}))
    for record, exact, colour, width in zip(noisy, clean, (LEVELS[0], LEVELS[2]), (3.0, 1.2), strict=True):
        rest = record.output - exact.output
        frequency, power = signal.welch(rest, record.rate, "blackmanharris", 2048, scaling="spectrum")
        shown = frequency < 150.0
        amplitude = np.sqrt(2.0 * power[shown])
        left.semilogy(frequency[shown], amplitude, color=colour, lw=width, label=f"{record.level:g} N")
        few = record.time < 0.1
        time = record.time[few]
        line = 2.0 * np.mean(rest * np.exp(-2j * np.pi * 50.0 * record.time))
        right.plot(1e3 * time, rest[few], ".", color=colour, markersize=3)
        right.plot(
            1e3 * time,
            (line * np.exp(2j * np.pi * 50.0 * time)).real,
            color=colour,
            label=f"{record.level:g} N",
        )
    left.axvline(50.0, color=NEUTRAL, linestyle="--", linewidth=0.8, label="50 Hz")
    label(left, "frequency [Hz]", "amplitude [m/s^2]")
    label(right, "time in the record [ms]", "residual [m/s^2]")
    return figure


def drive_harmonics() -> Figure:
    """A bent force; its harmonic in the response keeps its share at every level."""
    figure, left, right = panels("the force that acts is bent", "third harmonic of the response")
    phase = np.linspace(0.0, 2.0, 400)
    left.plot(phase, np.cos(2.0 * np.pi * phase), color=NEUTRAL, lw=3.0, label="recorded")
    bent = np.cos(2.0 * np.pi * phase) + 0.08 * np.cos(6.0 * np.pi * phase + 0.5)
    left.plot(phase, bent, color=AFTER, label="acting, h = 8 %")
    label(left, "cycles of the drive", "force / amplitude")
    force = np.linspace(10.0, 200.0, 60)
    f = np.array([4.5, 13.5])
    first, third = np.abs(receptance(f))
    right.plot(force, 0.08 * third / first * 100.0 + 0.0 * force, color=AFTER, label="drive harmonic")
    # To first order the cubic force k3 x^3 holds k3 X^3 / 4 of the third harmonic.
    size = force * first
    right.plot(force, 100.0 * 2.5e11 * size**3 / 4.0 * third / size, color=BEFORE, label="cubic spring")
    right.plot(
        force, 100.0 * 4.0 * 4.0 / (3.0 * np.pi) * third / size, "--", color=NEUTRAL, label="Coulomb friction"
    )
    right.set_ylim(0.0, 2.0)
    label(right, "force amplitude [N]", "share of the fundamental [%]")
    return figure


def floor_motion() -> Figure:
    """Scatter coloured by the transmissibility; with a sensor on the floor, the transmissibility itself."""
    figure, left, right = panels("scatter without a sensor on the floor", "residual / measured floor")
    plan = rig.SteppedSine((60.0,), (4.7,), 600, directions=("forward",))
    clean = rig.run(PLANT, plan, 3, rig.Bench(**{**vars(BENCH), "noise": 0.0}))[0].output
    for share, colour, name in ((0.0, NEUTRAL, "floor at rest"), (1.0, AFTER, "moving floor")):
        moved = PLANT.plus(rig.FloorMotion(share, 0.02, 0.5, 30.0))
        record = rig.run(moved, plan, 3, BENCH)[0]
        rest = record.output - clean
        frequency, power = signal.welch(rest, record.rate, nperseg=_WINDOW)
        left.loglog(frequency[1:], np.sqrt(power[1:]), color=colour, lw=1.2, label=name)
    floor = record.floor
    assert floor is not None
    left.axvline(RESONANCE, color=NEUTRAL, linestyle="--", linewidth=0.8, label="resonance")
    cross = signal.csd(floor, rest, record.rate, nperseg=_WINDOW)[1]
    own = signal.welch(floor, record.rate, nperseg=_WINDOW)[1]
    inside = (frequency > 0.7) & (frequency < 29.0)
    right.loglog(
        frequency[inside],
        np.abs(cross / own)[inside],
        ".",
        color=MEASURED,
        markersize=4,
        label="measured",
    )
    drawn = np.geomspace(0.5, 40.0, 200)
    right.loglog(drawn, np.abs(transmissibility(drawn)), color=AFTER, label="T = 1")
    right.loglog(drawn, 0.5 * np.abs(transmissibility(drawn)), "--", color=NEUTRAL, label="T = 0.5")
    label(left, "frequency [Hz]", "scatter [m/s^2/sqrt(Hz)]")
    label(right, "frequency [Hz]", "acceleration / floor's")
    return figure


PICTURES: tuple[Callable[[], Figure], ...] = (
    drive_harmonics,
    floor_motion,
    input_hold,
    mains_hum,
    stiffness_drift,
)


def main() -> None:
    """Draw every picture beside its page."""
    for picture in PICTURES:
        picture().savefig(HERE / f"{picture.__name__}.png", dpi=100)


if __name__ == "__main__":
    main()
