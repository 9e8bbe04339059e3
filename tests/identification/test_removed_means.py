"""Displacements without their mean, and thus without the rest that an asymmetric spring shifts by level."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import isojax as ij

CAMPAIGN = """
[campaign]
title = "means removed"
mass = {mass!r}
[input]
quantity = "force"
column = "force"
unit = "N"
[output]
quantity = "displacement"
column = "reading"
unit = "m"
[sampling]
time = "time"
[model]
stiffness = [{springs}]
damping = ["linear"]
"""
RECORD = '[[record]]\nfile = "{name}"\nrole = "{role}"\n'
RATE, FINER, CYCLES, LEVELS = 30, 8, 60, (0.5, 1.0, 0.8)
CASES = range(10)


def campaign_of(folder: Path, seed: int, springs: str = '"linear", "quadratic"') -> dict[str, float]:
    """Write records of `x'' + 2 zeta x' + x + a x^2 = force`, scaled, less their means; give what is true."""
    draw = np.random.default_rng(seed)
    mass, frequency = 10.0 ** draw.uniform(-6.0, 4.0), 10.0 ** draw.uniform(0.0, 4.0)
    size, ratio, rate = 10.0 ** draw.uniform(-8.0, -2.0), draw.uniform(0.02, 0.06), 2.0 * np.pi * frequency
    bend = draw.uniform(0.015, 0.05) * draw.choice([-1.0, 1.0])
    written = CAMPAIGN.format(mass=mass, springs=springs)
    fine = 2.0 * np.pi * np.arange(FINER * RATE * CYCLES) / (FINER * RATE)
    time, cycles = fine[::FINER], np.fft.rfftfreq(fine.size, 1.0 / (FINER * RATE))
    for place, level in enumerate(LEVELS):
        spectrum = np.fft.rfft(draw.standard_normal(fine.size)) * ((cycles > 0.3) & (cycles < 3.0))
        force = np.fft.irfft(spectrum, fine.size)
        force *= level / force.std()
        driven = CubicSpline(fine, force)

        def slope(instant, state, driven=driven):
            x, v = state
            return [v, driven(instant) - 2.0 * ratio * v - x - bend * x**2]

        x = solve_ivp(slope, (0.0, time[-1]), [0.0, 0.0], "DOP853", time, rtol=1e-10, atol=1e-11).y[0]
        reading = x + 0.004 * x.std() * draw.standard_normal(time.size)
        reading = size * (reading - reading.mean())
        force = mass * rate**2 * size * force[::FINER]
        np.savez(folder / f"r{place}.npz", time=time / rate, force=force, reading=reading)
        written += RECORD.format(name=f"r{place}.npz", role="holdout" if place == 2 else "fit")
    (folder / "campaign.toml").write_text(written, encoding="utf-8")
    return {
        "linear_stiffness": mass * rate**2,
        "quadratic_stiffness": mass * rate**2 * bend / size,
        "linear_damping": 2.0 * ratio * rate * mass,
    }


@pytest.mark.slow
@pytest.mark.parametrize("seed", CASES)
def test_each_record_has_a_zero_of_its_own_where_its_mean_was_removed(tmp_path: Path, seed: int):
    truth = campaign_of(tmp_path, seed)
    fitted = ij.fit(tmp_path)
    for name, error in zip(fitted.free, np.sqrt(np.diag(fitted.covariance)), strict=True):
        element, coefficient = name.split(".")
        value = float(getattr(fitted.model.element(element), coefficient))
        assert abs(value - truth[element]) < 4.0 * error, name
        assert error < 0.05 * abs(truth[element]), name
    assert fitted.errors["holdout"].nrmse < 1.3 * 0.004


@pytest.mark.slow
def test_an_asymmetric_spring_is_named_without_the_rest_that_it_shifts(tmp_path: Path):
    truth = campaign_of(tmp_path, 20, '"linear"')
    loop = ij.close_loop(tmp_path)
    assert [one.effect for one in loop.findings] == ["quadratic_stiffness"]
    for name, true in truth.items():
        found = loop.after.parameters[f"{name}.coefficient"]
        assert abs(found.value - true) < 4.0 * found.standard_error


def test_a_mean_that_is_there_is_no_removed_one(tmp_path: Path):
    campaign_of(tmp_path, 0)
    record = ij.read_campaign(tmp_path).records[0]
    assert record.lacks_mean("displacement")
    assert not record.lacks_mean("acceleration")
    stored = np.load(tmp_path / "r0.npz")
    moved = {**stored, "reading": stored["reading"] + 1e-5 * stored["reading"].std()}
    np.savez(tmp_path / "r0.npz", **moved)
    assert not ij.read_campaign(tmp_path).records[0].lacks_mean("displacement")
