"""Draw the signatures of effects with internal states and of instruments beside the pages of this folder.

python docs/effects/draw_memory.py
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from panels import label, panels

from isojax import elements
from isojax.reporting.plots._style import AFTER, BEFORE, LEVELS, MEASURED, NEUTRAL

jax.config.update("jax_enable_x64", True)

HERE = Path(__file__).parent
STEPS, CYCLES = 2048, 8
PHASE = 2.0 * np.pi * np.arange(STEPS) / STEPS
FREQUENCY = np.geomspace(0.5, 50.0, 240)
OMEGA = 2.0 * np.pi * FREQUENCY
MASS, STIFFNESS, DAMPING = 800.0, 1.08e6, 1.0e4
RESONANCE = np.sqrt(STIFFNESS / MASS) / (2.0 * np.pi)
DK, DC = "added stiffness [kN/m]", "added damping [kN s/m]"


@jax.jit
def _driven(element, size, omega):
    """Force of an element along x = size sin(omega t) from rest."""
    step = 2.0 * jnp.pi / STEPS

    def move(phase):
        return size * jnp.sin(phase), size * omega * jnp.cos(phase)

    def body(s, phase):
        def rate(share, states):
            return [step / omega * r for r in element.state_rate(*move(phase + share * step), tuple(states))]

        k1 = rate(0.0, s)
        k2 = rate(0.5, [a + 0.5 * k for a, k in zip(s, k1, strict=True)])
        k3 = rate(0.5, [a + 0.5 * k for a, k in zip(s, k2, strict=True)])
        k4 = rate(1.0, [a + k for a, k in zip(s, k3, strict=True)])
        parts = zip(s, k1, k2, k3, k4, strict=True)
        moved = tuple(a + (b + 2.0 * (c + d) + e) / 6.0 for a, b, c, d, e in parts)
        return moved, element.force(*move(phase), s)

    rest = (jnp.zeros(()),) * element.internal_states
    return jax.lax.scan(body, rest, step * jnp.arange(CYCLES * STEPS))[1][-STEPS:]


def loop(element, size: float, omega: float) -> np.ndarray:
    """Force [N] over the last of eight cycles of x = size sin(omega t)."""
    return np.asarray(_driven(element, jnp.asarray(size), jnp.asarray(omega)))


def equivalent(element, size: float, omega: float) -> tuple[float, float]:
    """Stiffness [N/m] and damping [N s/m] of the first harmonic."""
    force = loop(element, size, omega)
    return 2.0 * np.mean(force * np.sin(PHASE)) / size, 2.0 * np.mean(force * np.cos(PHASE)) / (size * omega)


def loops(ax: Axes, element, sizes: tuple[float, ...], omega: float) -> None:
    """Force over displacement at several amplitudes."""
    for size, colour in zip(sizes, LEVELS, strict=False):
        force = loop(element, size, omega)
        closed = np.append(force, force[:1])
        ax.plot(1e3 * size * np.sin(np.append(PHASE, 0.0)), closed, color=colour, label=f"{1e3 * size:g} mm")
    label(ax, "displacement [mm]", "force [N]")


def over_amplitude(ax: Axes, element, omega: float, colour: str, name: str, stiffness: bool) -> None:
    """Equivalent stiffness or damping over the amplitude."""
    sizes = np.geomspace(2e-5, 3e-3, 40)
    values = np.array([equivalent(element, size, omega) for size in sizes])
    ax.loglog(1e3 * sizes, 1e-3 * np.abs(values[:, 0 if stiffness else 1]), color=colour, label=name)


def over_frequency(axes: Sequence[Axes], dynamic: np.ndarray, colour: str, name: str, style="-") -> None:
    """Stiffness and damping of a dynamic stiffness over the frequency."""
    axes[0].semilogx(FREQUENCY, 1e-3 * dynamic.real, style, color=colour, label=name)
    axes[1].semilogx(FREQUENCY, 1e-3 * dynamic.imag / OMEGA, style, color=colour, label=name)


def labelled(axes: Sequence[Axes]) -> None:
    """Labels of stiffness and damping over the frequency."""
    label(axes[0], "frequency [Hz]", DK)
    label(axes[1], "frequency [Hz]", DC)


def coulomb_friction() -> Figure:
    """Height of the loop, and damping that falls with amplitude."""
    figure, left, right = panels("loop height 2 Fc at every amplitude", "equivalent damping")
    law = elements.CoulombFriction(10.0, 2e-4)
    loops(left, law, (3e-4, 1e-3, 2e-3), 27.0)
    for frequency, colour in zip((2.0, 4.3, 9.0), LEVELS, strict=False):
        omega = 2.0 * np.pi * frequency
        over_amplitude(right, law, omega, colour, f"{frequency:g} Hz", stiffness=False)
        sizes = np.geomspace(2e-5, 3e-3, 12)
        right.loglog(1e3 * sizes, 4e-3 * 10.0 / (np.pi * omega * sizes), ".", color=colour, markersize=3)
    right.plot([], [], ".", color=MEASURED, markersize=3, label="4 Fc / (pi w X)")
    label(right, "amplitude [mm]", DC)
    return figure


def dahl_friction() -> Figure:
    """A spring at small motion, friction at large."""
    figure, left, right = panels("loops open as the motion grows", "stiffness at 4.3 and 15 Hz alike")
    law = elements.DahlFriction(10.0, 2e-4)
    loops(left, law, (1e-4, 5e-4, 2e-3), 27.0)
    over_amplitude(right, law, 27.0, AFTER, "stiffness, 4.3 Hz", stiffness=True)
    sizes = np.geomspace(2e-5, 3e-3, 12)
    fast = [1e-3 * equivalent(law, size, 94.0)[0] for size in sizes]
    right.loglog(1e3 * sizes, fast, "o", color=BEFORE, markersize=3, label="stiffness, 15 Hz")
    right.axhline(1e-3 * 10.0 / 2e-4, color=NEUTRAL, linestyle="--", label="Fd / xd")
    label(right, "amplitude [mm]", DK)
    return figure


def bouc_wen() -> Figure:
    """Loops that soften and that harden."""
    figure, left, right = panels("gamma 0.5 beta: softening", "gamma -0.9 beta: nearly straight sides")
    for ax, shape in ((left, 0.5), (right, -0.9)):
        loops(ax, elements.BoucWen(5e4, 2e3, shape * 2e3, 1.0), (2e-4, 8e-4, 2e-3), 27.0)
    return figure


def lugre_friction() -> Figure:
    """Loops with a breakaway hump, and the friction of steady sliding."""
    figure, left, right = panels(
        "breakaway above sliding friction", "slow motion passes along the falling curve"
    )
    law = elements.LugreFriction(10.0, 1e-4, 0.8, 1e-2, 1e-3)
    loops(left, law, (1e-4, 5e-4, 2e-3), 27.0)
    speeds = np.linspace(1e-4, 0.05, 200)
    right.plot(
        1e3 * speeds, 10.0 * (1.0 + 0.8 * np.exp(-((speeds / 1e-2) ** 2))), color=MEASURED, label="steady"
    )
    for size, colour in zip((5e-4, 2e-3), LEVELS[1:], strict=False):
        force, velocity = loop(law, size, 27.0), size * 27.0 * np.cos(PHASE)
        moving = velocity > 0.0
        order = np.argsort(PHASE[moving] - 2.0 * np.pi * (PHASE[moving] > np.pi))
        x, y = 1e3 * velocity[moving][order], force[moving][order]
        right.plot(x, y, color=colour, label=f"half a cycle of {1e3 * size:g} mm")
    label(right, "velocity [mm/s]", "force [N]")
    return figure


def maxwell_branch() -> Figure:
    """Stiffness that comes and damping that goes with frequency."""
    figure, *axes = panels("dk = K (w tau)^2 / (1 + (w tau)^2)", "dc = K tau / (1 + (w tau)^2)")
    for tau, colour in zip((0.1, 0.03, 0.01), LEVELS, strict=False):
        over_frequency(axes, 1e5 * 1j * OMEGA * tau / (1 + 1j * OMEGA * tau), colour, f"tau {1e3 * tau:g} ms")
    labelled(axes)
    return figure


def dual_chamber() -> Figure:
    """A Maxwell branch whose time constant changes with level."""
    figure, *axes = panels("the transition moves down with level", "and so does the damping's shoulder")
    law = elements.DualChamber(1e5, 0.01, 1.5)
    frequency = np.geomspace(0.5, 50.0, 25)
    for size, colour in zip((1e-4, 1e-3, 5e-3), LEVELS, strict=False):
        both = np.array([equivalent(law, size, 2.0 * np.pi * f) for f in frequency])
        for ax, values in zip(axes, both.T, strict=True):
            ax.semilogx(frequency, 1e-3 * values, color=colour, label=f"{1e3 * size:g} mm")
    over_frequency(axes, 1e5 * 1j * OMEGA * 0.01 / (1 + 1j * OMEGA * 0.01), MEASURED, "o = 0", ":")
    labelled(axes)
    return figure


def fractional_damping() -> Figure:
    """Stiffness and loss that rise with a power of frequency."""
    figure, *axes = panels("stiffness: the law and its branches", "damping falls as w^(alpha - 1)")
    for order, colour in zip((0.2, 0.4, 0.7), LEVELS, strict=False):
        size = 1e5 / 27.0**order
        over_frequency(axes, size * (1j * OMEGA) ** order, colour, f"alpha {order}")
        element = elements.FractionalDamping(size, order, 27.0 / 40.0, 27.0 * 12.0)
        some = slice(10, None, 20)
        branches = np.array([equivalent(element, 1e-3, omega) for omega in OMEGA[some]])
        for ax, values in zip(axes, branches.T, strict=True):
            ax.plot(FREQUENCY[some], 1e-3 * values, "o", color=colour, markersize=3)
    axes[1].set_yscale("log")
    labelled(axes)
    return figure


def second_mode() -> Figure:
    """A notch and a second peak; mass below, nothing above."""
    figure, left, right = panels("receptance of the isolator", "added stiffness about the second mode")
    plain = STIFFNESS - MASS * OMEGA**2 + 1j * OMEGA * DAMPING
    near = (FREQUENCY > 3.0) & (FREQUENCY < 12.0)
    for own, colour in zip((4.5, 8.0, 25.0), LEVELS, strict=False):
        w2 = 2.0 * np.pi * own
        link = 40.0 * (w2**2 + 2j * 0.03 * w2 * OMEGA)
        added = -link * 40.0 * OMEGA**2 / (link - 40.0 * OMEGA**2)
        left.semilogy(
            FREQUENCY[near], 1e6 / np.abs(plain + added)[near], color=colour, label=f"w2 at {own:g} Hz"
        )
        right.plot(FREQUENCY[near], 1e-3 * added.real[near], color=colour)
    left.semilogy(FREQUENCY[near], 1e6 / np.abs(plain)[near], ":", color=MEASURED, label="without")
    right.plot(
        FREQUENCY[near], -1e-3 * 40.0 * OMEGA[near] ** 2, ":", color=MEASURED, label="added mass of 40 kg"
    )
    right.set_ylim(-700.0, 700.0)
    label(left, "frequency [Hz]", "displacement / force [um/N]")
    label(right, "frequency [Hz]", DK)
    return figure


def added_mass() -> Figure:
    """Minus dm w^2, and the look-alikes that draw the same line."""
    figure, left, right = panels(
        "added stiffness -dm w^2, no damping", "a gain error draws the same receptance"
    )
    band = (FREQUENCY > 2.0) & (FREQUENCY < 9.0)
    f, omega = FREQUENCY[band], OMEGA[band]
    for mass, colour in zip((-20.0, 20.0, 60.0), LEVELS, strict=False):
        left.plot(f, -1e-3 * mass * omega**2, color=colour, label=f"{mass:g} kg")
    gain = 0.08
    heavier = 1.0 / (STIFFNESS - MASS * (1.0 + gain) * omega**2 + 1j * omega * DAMPING)
    twin = (1.0 / (1.0 + gain)) / (
        STIFFNESS / (1.0 + gain) - MASS * omega**2 + 1j * omega * DAMPING / (1.0 + gain)
    )
    right.semilogy(f, 1e6 * np.abs(heavier), color=AFTER, linewidth=3.0, label="mass 8 % larger")
    right.semilogy(
        f, 1e6 * np.abs(twin), "--", color=BEFORE, label="force over-read by 8 %, k and c refitted"
    )
    label(left, "frequency [Hz]", DK)
    label(right, "frequency [Hz]", "displacement / force [um/N]")
    return figure


def input_delay() -> Figure:
    """Apparent damping that changes sign at the resonance."""
    figure, left, right = panels("apparent damping tau (k - m w^2)", "a relaxation never changes sign")
    band = (FREQUENCY > 2.0) & (FREQUENCY < 12.0)
    f, omega = FREQUENCY[band], OMEGA[band]
    plain = STIFFNESS - MASS * omega**2 + 1j * omega * DAMPING
    for delay, colour in zip((-1e-3, 1e-3, 2e-3), LEVELS, strict=False):
        added = plain * (np.exp(1j * omega * delay) - 1.0)
        left.plot(f, 1e-3 * added.imag / omega, color=colour, label=f"{1e3 * delay:g} ms")
    branch = 1e5 * 1j * omega * 0.03 / (1 + 1j * omega * 0.03)
    right.plot(f, 1e-3 * branch.imag / omega, color=MEASURED, label="Maxwell branch, 30 ms")
    for ax in (left, right):
        ax.axvline(RESONANCE, color=NEUTRAL, linestyle="--", linewidth=1.0, label="resonance")
        ax.axhline(0.0, color=NEUTRAL, linewidth=0.8)
        label(ax, "frequency [Hz]", DC)
    return figure


def ac_coupling() -> Figure:
    """Phase lead over the frequency, and a decaying zero."""
    figure, left, right = panels(
        "phase lead fc / f; a delay grows instead", "a constant is forgotten within 1 / wc"
    )
    for corner, colour in zip((0.05, 0.2, 0.5), LEVELS, strict=False):
        high = 1j * FREQUENCY / (1j * FREQUENCY + corner)
        left.semilogx(FREQUENCY, np.degrees(np.angle(high)), color=colour, label=f"fc {corner:g} Hz")
        time = np.linspace(0.0, 6.0, 200)
        right.plot(time, np.exp(-2.0 * np.pi * corner * time), color=colour)
    left.semilogx(FREQUENCY, -np.degrees(OMEGA * 1e-3), ":", color=MEASURED, label="delay of 1 ms")
    left.set_ylim(-20.0, 45.0)
    label(left, "frequency [Hz]", "phase of the reading [deg]")
    label(right, "time [s]", "reading of a step of one")
    return figure


def clipping() -> Figure:
    """The flat top, and where the readings pile up."""
    figure, left, right = panels(
        "reading of a level above the range", "pile-up at the level, at the top level only"
    )
    time = np.linspace(0.0, 0.5, 1000)
    rng = np.random.default_rng(5)
    for size, colour in zip((1.0, 1.6, 2.4), LEVELS, strict=False):
        motion = size * np.sin(2.0 * np.pi * 4.3 * time) + 0.15 * size * np.sin(6.0 * np.pi * 4.3 * time)
        reading = np.asarray(elements.Clipping(1.0, 1.8, 1.8).reading(jnp.asarray(motion), ()))
        left.plot(time, reading, color=colour, label=f"drive x {size:g}")
        noisy = reading + 0.01 * rng.standard_normal(reading.size)
        right.hist(noisy, bins=80, range=(-2.2, 2.2), histtype="step", color=colour)
    label(left, "time [s]", "acceleration [m/s^2]")
    label(right, "reading [m/s^2]", "samples")
    return figure


PICTURES: tuple[Callable[[], Figure], ...] = (
    ac_coupling,
    added_mass,
    bouc_wen,
    clipping,
    coulomb_friction,
    dahl_friction,
    dual_chamber,
    fractional_damping,
    input_delay,
    lugre_friction,
    maxwell_branch,
    second_mode,
)


def main() -> None:
    """Draw every picture beside its page."""
    for picture in PICTURES:
        picture().savefig(HERE / f"{picture.__name__}.png", dpi=110)


if __name__ == "__main__":
    main()
