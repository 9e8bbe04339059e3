"""The channel of the floor: read in any quantity, filtered as the others, and no part of the noise."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy.signal

from isojax import read_campaign, rig
from isojax.records import estimate_noise
from isojax.records.reading._floor_channel import floor_acceleration

RATE, SIZE = 200.0, 2000
TONES = ((0.03, 2.3, 0.4), (0.02, 11.0, 1.9), (0.004, 24.0, 3.0))
"""Acceleration [m/s^2], frequency [Hz] and phase."""


def floor(order: int) -> np.ndarray:
    """The floor's acceleration (0), velocity (1) or displacement (2), each tone integrated by hand."""
    time = np.arange(SIZE) / RATE
    parts = [a * np.exp(1j * (2 * np.pi * f * time + p)) / (2j * np.pi * f) ** order for a, f, p in TONES]
    return np.sum(parts, axis=0).real


def declared(quantity: str, unit: str, gain: str = "1.0") -> tuple[str, str]:
    section = (
        f'[floor]\nquantity = "{quantity}"\ncolumn = "ground"\nunit = "{unit}"\ngain = {gain}\n\n[model]'
    )
    return r"\[model\]", section


@pytest.mark.parametrize(
    ("quantity", "unit", "gain", "order", "factor"),
    [
        ("acceleration", "m/s^2", "1.0", 0, 1.0),
        ("acceleration", "V", "-0.5", 0, -2.0),
        ("velocity", "mm/s", "1.0", 1, 1e3),
        ("displacement", "um", "1.0", 2, 1e6),
    ],
)
def test_the_floor_is_an_acceleration_whatever_was_measured(
    quantity: str,
    unit: str,
    gain: str,
    order: int,
    factor: float,
    tiny: Callable[..., Path],
    channels: dict[str, np.ndarray],
) -> None:
    channels["ground"] = factor * (floor(order) + 0.01)
    record = read_campaign(tiny(declared(quantity, unit, gain), channels=channels)).records[0]
    assert record.floor is not None
    inside = slice(8, -8)  # the spline is one-sided at the ends
    expected = floor(0) - np.mean(floor(0))
    np.testing.assert_allclose(record.floor[inside], expected[inside], rtol=0, atol=2e-5 if order else 1e-9)
    assert abs(np.mean(record.floor)) < 1e-12


def test_the_readers_filter_runs_over_the_floor_as_well(
    tiny: Callable[..., Path], channels: dict[str, np.ndarray]
) -> None:
    channels["ground"] = floor(0)
    low = "[filter]\norder = 2\ncutoff_hz = 15.0\napplied = false\n\n[model]"
    kind, section = declared("acceleration", "m/s^2")
    record = read_campaign(tiny((kind, section.replace("[model]", low)), channels=channels)).records[0]
    assert record.floor is not None
    # Forwards and backwards: each tone by 1 / (1 + w^4), the bilinear w.
    time = np.arange(SIZE) / RATE
    expected = np.zeros(SIZE)
    for a, f, p in TONES:
        warped = np.tan(np.pi * f / RATE) / np.tan(np.pi * 15.0 / RATE)
        expected += a / (1 + warped**4) * np.cos(2 * np.pi * f * time + p)
    middle = slice(200, -200)
    np.testing.assert_allclose((record.floor - expected)[middle], 0.0, atol=1e-4)


def test_records_without_the_section_have_no_floor(tiny: Callable[..., Path]) -> None:
    campaign = read_campaign(tiny())
    assert campaign.floor is None
    assert campaign.records[0].floor is None


@pytest.mark.parametrize(
    ("ground", "message"),
    [
        (None, r"run\.csv has no column `ground`"),
        (np.full(SIZE, 0.2), r"column `ground` is constant \(0\.2 in SI throughout\)"),
        (np.where(np.arange(SIZE) == 17, np.nan, 1.0), r"column `ground` is nan at row 18"),
    ],
)
def test_a_bad_column_of_the_floor_is_refused(
    ground: np.ndarray | None,
    message: str,
    tiny: Callable[..., Path],
    channels: dict[str, np.ndarray],
) -> None:
    if ground is not None:
        channels["ground"] = ground
    with pytest.raises(ValueError, match=message):
        read_campaign(tiny(declared("acceleration", "m/s^2"), channels=channels))


def test_a_floor_under_a_driven_base_is_refused(
    tiny: Callable[..., Path], channels: dict[str, np.ndarray]
) -> None:
    channels["ground"] = floor(0)
    changes = (
        ('quantity = "force"', 'quantity = "base_acceleration"'),
        ('unit = "N"', 'unit = "m/s^2"'),
        declared("acceleration", "m/s^2"),
    )
    with pytest.raises(ValueError, match=r"\[floor\] belongs to an isolator on a floor, but \[input\]"):
        read_campaign(tiny(*changes, channels=channels))


def test_an_element_that_follows_the_floor_asks_for_its_section(tiny: Callable[..., Path]) -> None:
    folder = tiny((r'damping = \["linear"\]', 'damping = ["linear"]\nelements = ["floor_motion"]'))
    with pytest.raises(ValueError, match=r"\[model\] names `floor_motion`.*section \[floor\]"):
        read_campaign(folder)


def test_what_a_measured_floor_does_is_no_noise(tmp_path: Path) -> None:
    plant = rig.Plant((rig.LinearStiffness(1.08e6), rig.LinearDamping(1e4)), 800.0)
    plan = rig.SteppedSine((80.0,), (4.5, 5.5, 6.5), 16)
    bench = rig.Bench(rate=250.0, noise=0.01)
    sigma = {}
    for measured in (True, False):
        moved = plant.plus(rig.FloorMotion(1.0, 0.05, measured=measured))
        folder = tmp_path / str(measured)
        rig.write_campaign(folder, moved, plan, 2, "floor", bench)
        sigma[measured] = estimate_noise(read_campaign(folder)).sigma
    assert sigma[True] == pytest.approx(0.01, rel=0.06)
    assert sigma[False] > 0.02


def test_a_spline_of_the_seventh_degree_differentiates_to_a_thousandth_at_an_eighth_of_the_rate() -> None:
    time = np.arange(SIZE) / RATE
    omega = 2 * np.pi * RATE / 8.0
    wave = np.sin(omega * time) * scipy.signal.windows.hann(SIZE)
    expected = omega * np.cos(omega * time) * scipy.signal.windows.hann(SIZE)
    expected += (
        np.sin(omega * time) * np.pi * RATE / (SIZE - 1) * np.sin(2 * np.pi * np.arange(SIZE) / (SIZE - 1))
    )
    found = floor_acceleration(wave, RATE, "velocity")
    assert np.max(np.abs(found - expected)) < 1e-3 * omega
