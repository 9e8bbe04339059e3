"""A mass that hops between two rests: an oscillator with a negative linear stiffness, simulated by SciPy."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import isojax as ij

CAMPAIGN = """
[campaign]
title = "two wells"
mass = {mass!r}
[input]
quantity = "base_acceleration"
column = "base"
unit = "m/s^2"
[output]
quantity = "{quantity}"
column = "reading"
unit = "{unit}"
[sampling]
time = "time"
[model]
stiffness = ["linear", "cubic"]
damping = ["linear"]
"""
RECORD = '[[record]]\nfile = "{name}"\nrole = "{role}"\n'
UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}
RATE, FINER, CYCLES, LEVELS = 30, 8, 60, (0.5, 1.0, 0.8)
CASES = [(quantity, seed) for quantity in UNITS for seed in range(3)] + [("acceleration", 3)]


def campaign_of(folder: Path, seed: int, quantity: str) -> tuple[Path, dict[str, float]]:
    """Write records of `x'' + 2 zeta x' - x + x^3 = -base`, scaled, and give what is true."""
    draw = np.random.default_rng(seed)
    mass, frequency = 10.0 ** draw.uniform(-4.0, 3.0), 10.0 ** draw.uniform(0.0, 2.5)
    rest, ratio, rate = 10.0 ** draw.uniform(-5.0, -1.0), draw.uniform(0.02, 0.06), 2.0 * np.pi * frequency
    written = CAMPAIGN.format(mass=mass, quantity=quantity, unit=UNITS[quantity])
    fine = 2.0 * np.pi * np.arange(FINER * RATE * CYCLES) / (FINER * RATE)
    time, cycles = fine[::FINER], np.fft.rfftfreq(fine.size, 1.0 / (FINER * RATE))
    for place, level in enumerate(LEVELS):
        spectrum = np.fft.rfft(draw.standard_normal(fine.size)) * ((cycles > 0.2) & (cycles < 3.0))
        base = np.fft.irfft(spectrum, fine.size)
        base *= level / base.std()
        shaken = CubicSpline(fine, base)

        def slope(instant, state, shaken=shaken):
            x, v = state
            return [v, -shaken(instant) - 2.0 * ratio * v + x - x**3]

        begun = [float(draw.choice([-1.0, 1.0])), 0.0]
        x, v = solve_ivp(slope, (0.0, time[-1]), begun, "DOP853", time, rtol=1e-10, atol=1e-11).y
        reading = {"displacement": x, "velocity": v, "acceleration": -2.0 * ratio * v + x - x**3}[quantity]
        reading = reading + 0.005 * reading.std() * draw.standard_normal(time.size)
        reading *= rest * rate ** list(UNITS).index(quantity)
        base = base[::FINER] * rest * rate**2
        np.savez(folder / f"r{place}.npz", time=time / rate, base=base, reading=reading)
        written += RECORD.format(name=f"r{place}.npz", role="holdout" if place == 2 else "fit")
    (folder / "campaign.toml").write_text(written, encoding="utf-8")
    stiffness = mass * rate**2
    return folder, {
        "linear_stiffness": -stiffness,
        "cubic_stiffness": stiffness / rest**2,
        "linear_damping": 2.0 * ratio * rate * mass,
    }


@pytest.mark.slow
@pytest.mark.parametrize(("quantity", "seed"), CASES)
def test_both_wells_are_found_from_the_stiffness_of_one(tmp_path: Path, quantity: str, seed: int):
    folder, truth = campaign_of(tmp_path, seed, quantity)
    campaign = ij.read_campaign(folder)
    fitted = ij.fit(ij.classical_guess(campaign).model, campaign)
    errors = np.sqrt(np.diag(fitted.covariance))
    for name, error in zip(fitted.free, errors, strict=True):
        element, coefficient = name.split(".")
        value = float(getattr(fitted.model.element(element), coefficient))
        assert abs(value - truth[element]) < 4.0 * error, name
        assert error < 0.02 * abs(truth[element]), name
    assert fitted.innovations is not None
    assert fitted.innovations.is_noise
