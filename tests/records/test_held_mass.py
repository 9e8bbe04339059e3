"""Decays of a mass that is held and then let go, in closed form, from 1e-9 to 1e6 kg."""

from pathlib import Path

import numpy as np
import pytest

import isojax as ij

CAMPAIGN = """
[campaign]
title = "held, then released"
mass = {mass!r}
[input]
quantity = "force"
column = "force"
unit = "N"
[output]
quantity = "{quantity}"
column = "reading"
unit = "{unit}"
[sampling]
time = "time"
"""
RECORD = '[[record]]\nfile = "{name}"\nrole = "{role}"\n'
UNITS = {"displacement": "m", "velocity": "m/s", "acceleration": "m/s^2"}


def campaign_of(
    folder: Path, seed: int, quantity: str = "displacement"
) -> tuple[Path, dict[str, float], list[int]]:
    """Write four decays, each held for another time; what is true, and for how many samples it is held."""
    draw = np.random.default_rng(seed)
    mass, frequency = 10.0 ** draw.uniform(-9.0, 6.0), 10.0 ** draw.uniform(-1.0, 4.0)
    size, ratio = 10.0 ** draw.uniform(-7.0, -1.0), draw.uniform(0.02, 0.06)
    natural = 2.0 * np.pi * frequency
    damped, held = natural * np.sqrt(1.0 - ratio**2), []
    written = CAMPAIGN.format(mass=mass, quantity=quantity, unit=UNITS[quantity])
    pole = natural * complex(-ratio, np.sqrt(1.0 - ratio**2))
    order = list(UNITS).index(quantity)
    for place in range(4):
        count, amplitude = int(draw.integers(40, 300)), size * draw.uniform(0.5, 1.0)
        time = np.arange(count + 1000) / (40.0 * frequency)
        # x = Re(c e^(pole t)) with x = amplitude and v = 0 at the release.
        factor = amplitude * complex(1.0, -ratio * natural / damped)
        since = time - time[count]
        reading = np.real(factor * pole**order * np.exp(pole * np.maximum(since, 0.0)))
        reading = np.where(since > 0.0, reading, amplitude if order == 0 else 0.0)
        noise = 0.002 * size * natural**order * draw.standard_normal(time.size)
        np.savez(folder / f"r{place}.npz", time=time, force=np.zeros(time.size), reading=reading + noise)
        written += RECORD.format(name=f"r{place}.npz", role="holdout" if place == 3 else "fit")
        held.append(count)
    (folder / "campaign.toml").write_text(written, encoding="utf-8")
    stiffness, damping = mass * natural**2, 2.0 * ratio * natural * mass
    return folder, {"linear_stiffness": stiffness, "linear_damping": damping}, held


@pytest.mark.parametrize("quantity", UNITS)
@pytest.mark.parametrize("seed", range(10))
def test_a_decay_begins_at_the_release(tmp_path: Path, seed: int, quantity: str):
    folder, _, held = campaign_of(tmp_path, seed, quantity)
    for record, count in zip(ij.read_campaign(folder).records, held, strict=True):
        assert record.kind == "free_decay"
        assert count < record.held <= count + 10  # within a quarter of a cycle
        assert record.start == record.held
        assert record.output.size == count + 1000 - record.held
        assert "released after" in repr(record)


def test_a_record_that_begins_in_motion_stays_whole(tmp_path: Path):
    folder, _, held = campaign_of(tmp_path, 1)
    for place, count in enumerate(held):
        with np.load(folder / f"r{place}.npz") as file:
            moving = {name: file[name][count:] for name in file.files}
        np.savez(folder / f"r{place}.npz", **moving)
    assert [record.held for record in ij.read_campaign(folder).records] == [0] * len(held)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 4, 5])
def test_held_decays_of_any_size_give_spring_and_damper(tmp_path: Path, seed: int):
    folder, true, _ = campaign_of(tmp_path, seed)
    found = ij.fit(folder)
    for name, value in true.items():
        error = found.standard_errors[f"{name}.coefficient"]
        assert abs(float(found.model[f"{name}.coefficient"]) - value) < 4.0 * error < 0.01 * value
    errors = found.errors["holdout"]
    assert errors is not None
    assert errors.chi2_per_dof == pytest.approx(1.0, abs=0.2)
