"""Readings that jump: whether an anti-aliasing filter stood before the samples is found from the fit."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from isojax import Isolator, fit, read_campaign
from isojax.elements import CoulombFriction, LinearDamping, LinearStiffness
from isojax.models import Integrator

MASS, STIFFNESS, DAMPING, FRICTION, RATE, NOISE = 2.0, 8000.0, 12.0, 6.0, 400.0, 0.01


def rubbing(seed, level, count, start):
    """An oscillator with dry friction under a sum of sines, each slide by SciPy from one rest to the next.

    Source: Coulomb 1785; the mass is held where drive and spring leave less than the friction.
    """
    rng = np.random.default_rng(seed)
    frequencies = np.arange(4.0, 20.0, 0.37)
    phases = rng.uniform(0.0, 2.0 * np.pi, frequencies.size)
    time = np.arange(count) / RATE

    def force(t):
        size = level * np.sqrt(2.0 / frequencies.size)
        return size * np.sin(2.0 * np.pi * np.multiply.outer(t, frequencies) + phases).sum(axis=-1)

    acceleration, now, (x, v) = np.zeros(count), 0.0, start
    while now < time[-1]:
        if v == 0.0 and abs(force(now) - STIFFNESS * x) <= FRICTION:
            ahead = now + np.arange(1, 4000) * 1e-4
            loose = np.abs(force(ahead) - STIFFNESS * x) > FRICTION
            if not np.any(loose):
                now = ahead[-1]
                continue
            after = ahead[np.argmax(loose)]
            now = brentq(lambda t, x=x: abs(force(t) - STIFFNESS * x) - FRICTION, after - 1e-4, after) + 1e-12
        side = np.sign(v) if v != 0.0 else np.sign(force(now) - STIFFNESS * x)

        def rates(t, z, side=side):
            return [z[1], (force(t) - STIFFNESS * z[0] - DAMPING * z[1] - side * FRICTION) / MASS]

        def stops(t, z, side=side, begun=now):
            return side * z[1] + (1e-12 if t == begun else 0.0)

        stops.terminal, stops.direction = True, -1.0
        own = time[(time >= now) & (time <= min(now + 2.0, time[-1]))]
        found = solve_ivp(
            rates, (now, own[-1] + 1.0 / RATE if own.size else now + 0.1), [x, v], t_eval=own, events=stops,
            rtol=1e-9, atol=1e-12, dense_output=True,
        )  # fmt: skip
        places = np.round(found.t * RATE).astype(int)
        if places.size:
            z = found.y
            acceleration[places] = (
                force(found.t) - STIFFNESS * z[0] - DAMPING * z[1] - side * FRICTION
            ) / MASS
        if found.t_events[0].size:
            now, (x, v) = float(found.t_events[0][0]) + 1e-12, (float(found.y_events[0][0][0]), 0.0)
        else:
            now = float(found.sol.t_max)
            x, v = map(float, found.sol(now))
    return force(time), acceleration + NOISE * rng.standard_normal(count)


CAMPAIGN = """\
[campaign]
title = "dry friction, sampled at instants"
mass = 2.0
[input]
quantity = "force"
column = "force"
unit = "N"
[output]
quantity = "acceleration"
column = "acceleration"
unit = "m/s^2"
noise = 0.01
[sampling]
rate = 400.0
[model]
stiffness = ["linear"]
damping = ["linear", "coulomb_friction"]
"""


@pytest.mark.slow
def test_samples_taken_at_instants_are_recognised_and_mid_motion_starts_found(tmp_path: Path):
    text = CAMPAIGN
    for place, level in enumerate((20.0, 40.0)):
        drive, output = rubbing(place, level, 2400, (0.0, 0.0))
        np.savez(tmp_path / f"{place}.npz", force=drive[400:], acceleration=output[400:])
        text += f'[[record]]\nfile = "{place}.npz"\nrole = "fit"\n'
    (tmp_path / "campaign.toml").write_text(text)
    campaign = read_campaign(tmp_path / "campaign.toml")
    start = Isolator(
        MASS,
        (
            LinearStiffness(1.05 * STIFFNESS),
            LinearDamping(1.3 * DAMPING),
            CoulombFriction(0.8 * FRICTION, 1e-3),
        ),
    )
    found = fit(start, campaign)
    assert not found.estimate.problem.integrator.band_limited
    assert found.stats.chi2 / found.stats.dof < 1.2
    truth = {"k1": STIFFNESS, "c1": DAMPING, "Fc": FRICTION}
    for name, value in truth.items():
        one = found.parameters[name]
        assert abs(one.value - value) < 5.0 * one.standard_error, name
        assert one.standard_error < 0.01 * value


def test_a_record_is_taken_for_band_limited_until_a_fit_says_otherwise():
    assert Integrator().band_limited
    assert Integrator(band_limited=False).with_steps(256).band_limited is False
