"""A filter that force and response share bends a cubic spring, unless the reader takes it out."""

import re

import numpy as np
import pytest
import scipy.signal

from isojax import classical_guess, fit, read_campaign, rig
from isojax.records import estimate_noise

RATE, ORDER, CUTOFF = 250.0, 2, 20.0
NOISE = 2e-4
NAME = "cubic_stiffness.coefficient"
CUBIC = 2.5e11
PLANT = rig.Plant((rig.LinearStiffness(1.08e6), rig.CubicStiffness(CUBIC), rig.LinearDamping(1e4)))
PLAN = rig.SteppedSine((60.0, 120.0), (4.4, 5.2, 6.0), 12)


def _filed(folder, plant=PLANT, plan=PLAN):
    """A campaign whose recorder ran both channels through a Butterworth filter, forwards."""
    bench = rig.Bench(rate=RATE, noise=NOISE, force_noise=0.0, drift=0.0)
    file = rig.write_campaign(folder, plant, plan, 3, "filtered", bench)
    sections = scipy.signal.butter(ORDER, CUTOFF, fs=RATE, output="sos")
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as arrays:
            columns = {
                name: scipy.signal.sosfilt(sections, arrays[name])
                if name in ("force", "acceleration")
                else arrays[name]
                for name in arrays
            }
        np.savez(path, **columns)
    text = file.read_text(encoding="utf-8")
    text = text.replace('["linear", "abs_quadratic", "cubic"]', '["linear", "cubic"]', 1)
    return file, text.replace('["linear", "abs_quadratic", "cubic"]', '["linear"]', 1)


def test_a_cubic_spring_is_right_where_the_filter_is_taken_out(tmp_path):
    file, text = _filed(tmp_path)
    off = {}
    for compensate in (False, True):
        flag = str(compensate).lower()
        low = f"[filter]\norder = {ORDER}\ncutoff_hz = {CUTOFF}\ncompensate = {flag}\n"
        file.write_text(f"{text}\n{low}", encoding="utf-8")
        campaign = read_campaign(file)
        found = fit(classical_guess(campaign).model, campaign)
        off[compensate] = float(found.model[NAME]) / CUBIC - 1.0, found.standard_errors[NAME] / CUBIC
    error, sigma = off[True]
    assert abs(error) < 3.0 * sigma < 0.01
    # The filter left in also looks like scatter between the records, which widens its error bars.
    assert abs(off[False][0]) > max(0.015, 5.0 * sigma)
    assert found.stats.chi2 / found.stats.dof < 1.1


def test_a_record_too_short_for_what_is_lost_at_its_ends_is_refused(tmp_path):
    file, text = _filed(tmp_path)
    text = text.replace('role = "fit"', 'role = "fit"\nstop = 200', 1)
    file.write_text(f"{text}\n[filter]\norder = 2\ncutoff_hz = 20.0\ncompensate = true\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"number 1 is too short: of its samples 100 at either end are lost"):
        read_campaign(file)


@pytest.mark.parametrize(
    ("plan", "cutoff", "message"),
    [
        (
            rig.Impulse((40.0, 80.0)),
            30.0,
            r"number 1: \[filter\] compensate = true loses 100 samples .*drive",
        ),
        (
            rig.Multisine((60.0,), lowest=2.0, highest=12.0, period=8.0, periods=1),
            10.0,
            r"number 1 has \d+ samples left, .* loses 200 at either end; expected at least its period = 2000",
        ),
    ],
)
def test_a_record_that_loses_its_blow_or_its_period_at_its_ends_is_refused(tmp_path, plan, cutoff, message):
    file, text = _filed(tmp_path, plan=plan)
    text = re.sub(r"settle = \d+\n", "", text)
    plain = f"{text}\n[filter]\norder = 2\ncutoff_hz = {cutoff}\n"
    file.write_text(plain, encoding="utf-8")
    assert read_campaign(file).records
    file.write_text(f"{plain}compensate = true\n", encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        read_campaign(file)


@pytest.mark.parametrize("flag", ["false", "true"])
def test_harmonics_beyond_the_cut_off_are_no_noise(tmp_path, flag):
    """Dry friction has them without end: taken for noise, they would make any misfit look small."""
    plant = rig.Plant((*PLANT.laws, rig.CoulombFriction(2.0)))
    file, text = _filed(tmp_path, plant, rig.SteppedSine((60.0, 120.0), (4.4, 5.2, 6.0), 20))
    file.write_text(
        f"{text}\n[filter]\norder = {ORDER}\ncutoff_hz = {CUTOFF}\ncompensate = {flag}\n", encoding="utf-8"
    )
    found = estimate_noise(read_campaign(file))
    assert found.method == "cycle_scatter"
    assert found.white == pytest.approx(NOISE, rel=0.08)
