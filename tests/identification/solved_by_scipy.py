"""Campaigns of an isolator whose equation SciPy integrates, for effects that the simulated bench lacks.

The laws are the elements'; the integrator shares nothing with isojax.
"""

from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp

from isojax.elements import AbstractElement
from isojax.records import Campaign, InputChannel, OutputChannel, Record

MASS, RATE, NOISE = 800.0, 500.0, 2e-3
PERIOD, RUN_IN, KEPT = 2.0, 1, 4
LINES = np.arange(2.0, 14.0, 1.0 / PERIOD)


class Multisine:
    """A periodic force of random phases, of a given rms."""

    def __init__(self, level: float, seed: int):
        self.phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, LINES.size)
        self.size = level * np.sqrt(2.0 / LINES.size)

    def __call__(self, time, rate: bool = False):
        angle = 2.0 * np.pi * np.multiply.outer(time, LINES) + self.phases
        if rate:
            return -self.size * np.sum(2.0 * np.pi * LINES * np.sin(angle), axis=-1)
        return self.size * np.sum(np.cos(angle), axis=-1)


@eqx.filter_jit
def _rates(elements: tuple[AbstractElement, ...], state, u, u_rate):
    """Rates of the state, and the reading of an accelerometer."""
    x, v, *internal = state
    shares = []
    for element in elements:
        shares.append(tuple(internal[: element.internal_states]))
        internal = internal[element.internal_states :]
    for element in elements:
        u, u_rate = element.drive(u, u_rate)
    force = sum(element.force(x, v, s) for element, s in zip(elements, shares, strict=True))
    a = (u - force) / (MASS + sum(element.inertia() for element in elements))
    y, rates = a, []
    for element, s in zip(elements, shares, strict=True):
        laws = zip(element.state_rate(x, v, s), element.reading_rate(y, s), strict=True)
        rates += [law + sensed for law, sensed in laws]
        y = element.reading(y, s)
    return jnp.stack([v, a, *rates]), y


def solved(elements: tuple[AbstractElement, ...], levels=(60.0, 110.0), seed: int = 3, **fields) -> Campaign:
    """A campaign of one record a level, of forces in N; fields of the campaign may be given."""
    noise, shift = np.random.default_rng(seed), float(sum(element.shift() for element in elements))
    states = 2 + sum(element.internal_states for element in elements)
    start = RUN_IN * PERIOD
    time = start + np.arange(round(KEPT * PERIOD * RATE)) / RATE
    records = []
    for place, level in enumerate(levels):
        drive = Multisine(level, seed + place)

        def asked(t, state, drive=drive):
            return _rates(elements, state, np.asarray(drive(t - shift)), np.asarray(drive(t - shift, True)))

        def slopes(t, state, asked=asked):
            return np.asarray(asked(t, state)[0])

        found = solve_ivp(
            slopes, (0.0, time[-1]), np.zeros(states), "DOP853", time, rtol=1e-8, atol=1e-11, max_step=0.03
        )
        assert found.success
        reading = np.asarray(asked(time, found.y)[1]) + NOISE * noise.standard_normal(time.size)
        name, force = f"level{place}", drive(time)
        records.append(
            Record(
                name,
                Path(f"{name}.npz"),
                time - start,
                RATE,
                force,
                reading,
                force,
                reading,
                level=level,
                period=round(PERIOD * RATE),
                role="fit",
                kind="periodic",
            )
        )
    standard = {
        "title": "solved by SciPy",
        "file": Path("scipy/campaign.toml"),
        "mass": MASS,
        "mass_free": False,
        "input": InputChannel("force", "force", "N"),
        "output": OutputChannel("acceleration", "acceleration", "m/s^2", noise=NOISE),
        "filter": None,
        "rate": RATE,
        "stiffness": ("linear",),
        "damping": ("linear",),
        "elements": (),
        "records": tuple(records),
    }
    return Campaign(**{**standard, **fields})
